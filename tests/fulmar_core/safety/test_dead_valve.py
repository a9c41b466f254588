"""The envelope guard finds a dead valve of a body in space by its motion, and stops the body without that valve."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.controllers.classical import load_classical
from fulmar_core.controllers.controller import Inputs
from fulmar_core.estimators.actuator_health.actuator_estimator import sure_of
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.envelope.dead_check import NONE
from fulmar_core.safety.envelope.guard import EnvelopeGuard
from fulmar_core.safety.envelope.motion import Motion, attitude_after, crossed, in_world
from fulmar_core.safety.envelope.response_check import DEAD
from fulmar_core.safety.envelope.response_fit import ManyFit, SingleFit
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_in_float64
from fulmar_core.worlds.parts import Actuation, Push
from fulmar_core.worlds.scenario import Scenario

SPACECRAFT, PLATFORM = load_robot("spacecraft_16"), load_robot("floating_platform")
SIDE, WORLDS = 20.0, 4
PUSH, ACTUATION = Push(force=0.1, torque=0.05), Actuation(gain=(0.9, 1.0), delay_s=0.06)


def driven(*, robot=SPACECRAFT, dead=0, seconds=20.0, notices=True, guard=EnvelopeGuard):
    """The guard and the law's bodies after a drive with so many dead valves, and which valves truly work."""
    actuation = replace(ACTUATION, failures=dead, failure_chance=float(dead))
    scenario = Scenario("altered", sensor_noise=True, body="nominal", push=PUSH, actuation=actuation)
    task = load_task("go_to_pose" + robot.state_type.SUFFIX)
    controller = load_classical(robot, task)
    simulation = BatchSimulation(robot, task, scenario, worlds=WORLDS, seed=5)
    area = (-SIDE, SIDE) * robot.state_type.AXES
    envelope = guard(robot, controller.control_hz, area=area, notices=notices)
    loop = ControlLoop(robot, task, controller, robots=WORLDS, envelope=envelope)
    loop.begin(goal_in_float64(simulation.goal))
    for step in range(round(seconds * controller.control_hz)):
        simulation.move(loop.step(simulation.measured, {}, round(1e9 * step * loop.dt)).command)
    return envelope, np.asarray(simulation.world.alive).T


def test_a_body_whose_valves_all_work_is_left_to_its_controller():
    envelope, _ = driven()
    assert (envelope._response.parts.dead == NONE).all() and not envelope.holds.any()


def test_a_dead_valve_is_found_and_named_and_the_body_is_stopped_for_good_without_it():
    envelope, truth = driven(dead=1)
    parts = envelope._response.parts
    assert (parts.alive == truth).all(), "the valve that is dead, and no other"
    assert envelope.holds.all() and (envelope._unlike == DEAD).all()
    name = SPACECRAFT.actuators.names[int(truth[0].argmin())]
    assert envelope.events[0].cause.startswith(f"{name} gives no thrust") and len(envelope.events) == 1


@pytest.mark.parametrize("robot", [SPACECRAFT, PLATFORM], ids=lambda robot: robot.name)
@pytest.mark.parametrize("altered", [{"gain": (0.6, 0.6)}, {"delay_s": 0.16, "least_delay": 1.0}])
def test_weak_thrust_and_late_commands_are_no_dead_valve(robot, altered, monkeypatch):
    monkeypatch.setattr("tests.fulmar_core.safety.test_dead_valve.ACTUATION", replace(ACTUATION, **altered))
    envelope, _ = driven(robot=robot)
    assert (envelope._response.parts.dead == NONE).all() and envelope.holds.all()


def test_in_the_plane_a_valve_that_is_found_is_the_dead_one():
    envelope, truth = driven(robot=PLATFORM, dead=1)
    dead = envelope._response.parts.dead
    assert (dead != NONE).any()
    assert ((dead == NONE) | (dead == truth.argmin(axis=1))).all()


def test_an_area_alone_counts_with_a_dead_valve_and_lets_the_controller_act():
    envelope, truth = driven(dead=1, notices=False)
    assert (envelope._response.parts.alive == truth).all() and not envelope.holds.any()


def test_the_backup_does_not_open_a_valve_that_is_dead():
    opened = []

    class Seen(EnvelopeGuard):
        def guarded(self, *given):
            sent = super().guarded(*given)
            opened.append((sent > 0.0) & (self._response.parts.alive == 0.0) & self.holds[:, None])
            return sent

    driven(dead=1, seconds=20.0, guard=Seen)
    assert not np.array(opened).any()


@pytest.mark.parametrize("seed", range(3))
def test_sums_of_one_body_in_plain_numbers_have_the_bits_of_many_bodies(seed):
    random = np.random.default_rng(seed)
    quat = random.normal(size=(5, 4))
    quat /= np.linalg.norm(quat, axis=1, keepdims=True)
    angle, vector = random.normal(size=(5, 3)), random.normal(size=(5, 3))
    assert (attitude_after(quat, angle)[2:3] == attitude_after(quat[2:3], angle[2:3])).all()
    assert (in_world(quat, vector)[2:3] == in_world(quat[2:3], vector[2:3])).all()
    assert (crossed(angle, vector)[2:3] == crossed(angle[2:3], vector[2:3])).all()


def test_motion_under_a_command_that_was_seen_before_is_that_of_a_new_one():
    motion, command = Motion(SPACECRAFT), np.eye(16)[3:4]
    now = RigidBodyState(
        np.zeros((1, 3)), np.array([[0.0, 0.0, 0.0, 1.0]]), np.zeros((1, 3)), np.zeros((1, 3))
    )
    first, again = motion.after(now, command, 0.2), motion.after(now, command.copy(), 0.2)
    assert (first.velocity_in_world == again.velocity_in_world).all() and first.velocity_in_world.any()
    many = motion.after(
        RigidBodyState(
            *(
                np.tile(part, (2, 1))
                for part in (
                    now.position_in_world,
                    now.quat_xyzw,
                    now.velocity_in_world,
                    now.angular_velocity_in_body,
                )
            )
        ),
        np.tile(command, (2, 1)),
        0.2,
    )
    assert np.allclose(many.velocity_in_world, first.velocity_in_world, atol=1e-15)


def test_the_fit_of_one_body_is_that_of_many():
    random, many, single = np.random.default_rng(1), ManyFit(1), SingleFit()
    for _ in range(40):
        columns, change = random.normal(size=(2, 3, 1, 3)), random.normal(size=(2, 1, 3))
        one, other = many.add(columns, change), single.add(columns, change)
    for name in ("gain", "unsure", "late", "vary"):
        assert getattr(one, name) == pytest.approx(getattr(other, name), abs=1e-12)


def test_a_push_that_an_estimator_makes_of_weak_thrust_is_not_braked_by():
    envelope = EnvelopeGuard(PLATFORM, 5.0, area=(-2.0, 2.0, -2.0, 2.0))
    still = PlanarState(*(np.zeros(1) for _ in range(6)))
    known = replace(sure_of(np.ones((1, 8)), still), push=np.array([[0.3, 0.0, 0.0]]))
    inputs = Inputs(still, None, None, np.zeros((1, 8)), None, 0, 0.2)
    assert envelope._rolled(still.to_rigid(), inputs, known)[1].push.any()
    envelope._response.strength = np.array([0.7])
    assert not envelope._rolled(still.to_rigid(), inputs, known)[1].push.any()
