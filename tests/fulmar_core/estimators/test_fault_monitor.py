"""Valves and fans that stick are named, those that work are not, whatever controls the robot."""

from __future__ import annotations

from copy import copy
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.estimators.actuator_health import fault_monitor
from fulmar_core.estimators.actuator_health.applied import AppliedHistory
from fulmar_core.estimators.actuator_health.beliefs import NO_EFFECT
from fulmar_core.estimators.actuator_health.fault_monitor import FaultMonitor
from fulmar_core.estimators.actuator_health.hypotheses import can_monitor
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.rotation import from_yaw
from fulmar_core.states.state import RigidBodyState
from fulmar_core.worlds.parts import Push
from fulmar_core.worlds.scenario import load_scenario
from tests.watched_actuators import CLOSED, HALF, OPEN, sticking, watch

IN_PLANE = [("floating_platform", "go_to_pose", law) for law in ("lqr", "policy")]
BY_DEGREES = [("modular_freeflyer", "go_to_pose", "lqr")]
IN_SPACE = [
    (robot, "go_to_pose_3d", law) for robot in ("spacecraft_16", "int_ball2") for law in ("lqr", "policy")
]
ALL = [*IN_PLANE, *BY_DEGREES, *IN_SPACE]


def watched(system, at, *, episodes, seconds, scenario="nominal", **more):
    of = load_scenario(scenario) if at is None else sticking(at, scenario=scenario, **more)
    return watch(*system, of, episodes=episodes, seconds=seconds)


@pytest.mark.parametrize("system", [IN_PLANE[1], IN_SPACE[2]], ids=lambda system: system[0])
def test_what_sticks_open_is_named_and_nothing_else(system):
    found = watched(system, OPEN, episodes=3, seconds=10.0, from_s=(1.0, 1.0))
    assert [each.wrong(OPEN) for each in found] == [[]] * 3
    assert sum(each.right(OPEN) for each in found) == 3
    part = found[0].part
    noun = "fan" if part.startswith("fan") else "valve"
    assert f"{noun} {part} is stuck open" in found[0].said


@pytest.mark.parametrize("system", [IN_PLANE[0], IN_SPACE[3]], ids=lambda system: system[0])
def test_what_stays_closed_is_named_and_nothing_else(system):
    found = watched(system, CLOSED, episodes=3, seconds=12.0, from_s=(0.0, 0.0))
    assert [each.wrong(CLOSED) for each in found] == [[]] * 3
    assert sum(each.right(CLOSED) for each in found) >= 2


@pytest.mark.parametrize("system", [IN_PLANE[1], IN_SPACE[1]], ids=lambda system: system[0])
def test_nothing_is_said_of_what_works(system):
    found = watched(system, None, episodes=3, seconds=8.0)
    assert [each.said for each in found] == [()] * 3


class Standing:
    """A platform that is measured where it stands, whatever it is commanded, and what is believed of its valves."""

    def __init__(self, *, knows_applied=True):
        self.robot = load_robot("floating_platform")
        self.applied = AppliedHistory(hold_ns=400_000_000)
        self.monitor = FaultMonitor(self.robot, self.applied, control_hz=5.0, lockstep=True)
        self._knows, self._rng, self.now_ns = knows_applied, np.random.default_rng(4), 0

    def go(self, seconds):
        rng, said = self._rng, {}
        for _ in range(round(5 * seconds)):
            state = RigidBodyState(
                np.array([*rng.normal(0.0, 0.001, 2), 0.0]),
                from_yaw(np.array(rng.normal(0.0, 0.002))),
                np.array([*rng.normal(0.0, 0.005, 2), 0.0]),
                np.array([0.0, 0.0, rng.normal(0.0, 0.01)]),
            )
            self.monitor.take(state, self.now_ns)
            if self._knows:
                self.applied.add(self.now_ns, np.eye(8)[rng.integers(8)])
            self.now_ns += 200_000_000
            said |= dict.fromkeys(self.monitor.beliefs.words)
        return list(said)


def test_of_a_robot_that_a_hand_holds_no_valve_is_accused():
    assert Standing().go(10.0) == [NO_EFFECT]


def test_where_it_is_not_known_what_was_applied_nothing_is_believed():
    assert Standing(knows_applied=False).go(10.0) == []


def test_what_was_believed_before_time_jumped_back_is_forgotten():
    standing = Standing()
    standing.go(10.0)
    assert standing.monitor.beliefs.words
    standing.now_ns = 0
    standing.go(0.2)
    assert standing.monitor.beliefs.words == ()


@pytest.mark.parametrize("sticks", [None, 3], ids=["sound", "one sticks"])
def test_what_is_skipped_while_nothing_is_wrong_changes_nothing(sticks, monkeypatch):
    found = {}
    for skips in (True, False):
        if not skips:
            monkeypatch.setattr(fault_monitor, "SOUND", np.inf)
        robot = load_robot("floating_platform")
        applied = AppliedHistory(hold_ns=400_000_000)
        monitor = FaultMonitor(robot, applied, control_hz=5.0, lockstep=True)
        wrench = robot.actuators.wrench_per_newton
        rng, motion, said = np.random.default_rng(1), np.zeros(6), []
        for number in range(60):
            command = np.eye(8)[rng.integers(8)]
            doing = command.copy()
            if sticks is not None and number > 10:
                doing[sticks] = 0.0
            force = np.concatenate((doing @ wrench[:, :2], [0.0]))
            place, speed = motion[:3], motion[3:]
            motion = np.concatenate((place + 0.2 * speed, speed + 0.2 * force / robot.body.mass))
            state = RigidBodyState(
                np.append(place[:2], 0.0), from_yaw(np.array(0.0)), np.append(speed[:2], 0.0), np.zeros(3)
            )
            monitor.take(state, 200_000_000 * number)
            applied.add(200_000_000 * number, command)
            said.append((monitor.beliefs, monitor.suspects))
        found[skips] = said
    assert found[True] == found[False]


def test_a_push_as_large_as_a_valves_thrust_is_no_valve():
    pushed = replace(load_scenario("nominal"), push=Push(force=1.0, torque=0.5, least=1.0))
    found = watch("floating_platform", "go_to_pose", "lqr", pushed, episodes=4, seconds=10.0, seed=5)
    assert [each.open for each in found] == [{}] * 4


@pytest.mark.parametrize("name", ["floating_platform", "spacecraft_16", "int_ball2", "modular_freeflyer"])
def test_robots_with_valves_or_fans_are_watched(name):
    assert can_monitor(load_robot(name))


def test_bodies_that_their_actuators_carry_are_not_as_their_weight_would_be_a_push():
    robot = copy(load_robot("int_ball2"))  # read once, for all tests
    assert can_monitor(robot)
    robot.__dict__["kind"] = replace(robot.kind, weighs=True)
    assert not can_monitor(robot)


@pytest.mark.parametrize("name", ["kingfisher", "turtlebot2", "cubesat_wheels", "airship_v7"])
def test_robots_that_swim_or_push_both_ways_are_not(name):
    assert not can_monitor(load_robot(name))


@pytest.mark.slow
@pytest.mark.parametrize("system", ALL, ids="-".join)
@pytest.mark.parametrize("at", [OPEN, CLOSED])
def test_of_20_robots_with_one_that_sticks_at_least_12_are_named_and_at_most_4_wrongly(system, at):
    found = watched(system, at, episodes=20, seconds=20.0)
    assert sum(each.right(at) for each in found) >= 12
    assert sum(bool(each.wrong(at)) for each in found) <= 1


@pytest.mark.slow
@pytest.mark.parametrize("system", ALL, ids="-".join)
def test_of_20_robots_that_work_none_is_accused(system):
    found = watched(system, None, episodes=20, seconds=20.0)
    assert [each.wrong(None) for each in found] == [[]] * 20


@pytest.mark.slow
def test_fans_and_valves_that_stick_half_open_are_named():
    for system in (*BY_DEGREES, IN_SPACE[2]):
        found = watched(system, HALF, episodes=20, seconds=20.0)
        assert sum(each.right(HALF) for each in found) >= 12
        assert not any(each.wrong(HALF) for each in found)


DISTURBED = {
    "floating_platform": (
        "uncertain", "randomised", "roboran", "lab_valves", "lab_tether", "lab_slope", "drift_force_4",
        "drift_force_torque", "drift_floor_wave", "drift_action_noise", "drift_velocity_noise_4",
    ),
    "modular_freeflyer": ("uncertain", "randomised"),
    "spacecraft_16": ("uncertain", "randomised"),
    "int_ball2": ("uncertain", "randomised"),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    ("robot", "scenario"), [(robot, name) for robot, names in DISTURBED.items() for name in names]
)
def test_pushes_uneven_floors_and_other_masses_are_no_faults(robot, scenario):
    task = "go_to_pose" if load_robot(robot).body.planar else "go_to_pose_3d"
    found = watched((robot, task, "lqr"), None, episodes=20, seconds=20.0, scenario=scenario)
    # The hardest of them has dead actuators of its own.
    assert sum(bool(each.wrong(None)) for each in found) <= (3 if scenario == "randomised" else 1)
    assert not any(each.open for each in found) or scenario == "randomised"
