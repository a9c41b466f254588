"""A plant whose tank runs empty: a failure that is announced and closes the valves, and no trip of the watchdog."""

from __future__ import annotations

import threading
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fulmar_core.estimators.actuator_health.feedback_check import ActuatorFeedback
from fulmar_core.estimators.actuator_health.supply_check import EMPTY
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.actuator_guard import ActuatorGuard
from fulmar_core.safety.watchdog import Watchdog
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.tasks import load_task
from fulmar_core.worlds.parts import Actuation, Supply
from fulmar_core.worlds.scenario import load_scenario
from fulmar_ros.plant_clock import SimulatedTime
from fulmar_ros.plant_loops import RealtimeLoop
from sim_nodes.mock_backend import MockBackend
from tests.fulmar_ros.quiet_wires import quiet_wires

ROBOTS = [
    ("cubesat_8", "go_to_pose_3d"),
    ("spacecraft_16", "go_to_pose_3d"),
    ("floating_platform", "go_to_pose"),
]


def flown(name, task, *, share, seconds):
    """The guard after valves were open for a while with a tank that began so full, and the true states."""
    robot = load_robot(name)
    scenario = replace(load_scenario("ideal"), actuation=Actuation(supply=Supply(tank=share)))
    backend = MockBackend(robot)
    sample = backend.reset(draw_episode(robot, load_task(task), scenario, seed=1, number=0), seed=1)
    guard = ActuatorGuard(robot.actuators, Watchdog(10**10))
    command = np.zeros(len(robot.actuators.names))
    command[:2] = 1.0
    states, applied = [], []

    def step(given):
        guard.offer(robot.actuators.names, command, time.monotonic_ns())
        found = backend.step(given)
        states.append(found.truth)
        applied.append(given)
        return found

    def ignore(*_arguments):
        """There is no subscriber."""

    guard.offer(robot.actuators.names, command, time.monotonic_ns())
    wires = quiet_wires()
    feedback = ActuatorFeedback(robot, moves=False)
    loop = RealtimeLoop(
        SimpleNamespace(robot=robot, step=step), wires, guard, SimulatedTime(), rate=50.0, feedback=feedback
    )
    loop.run(sample, round(seconds / robot.timing.physics_dt), threading.Event())
    return guard, feedback, states, np.array(applied)


@pytest.mark.parametrize(("name", "task"), ROBOTS)
def test_an_empty_tank_is_a_failure_that_closes_the_valves_for_good(name, task):
    guard, feedback, states, applied = flown(name, task, share=0.0, seconds=3.0)
    assert guard.failed.startswith(f"{EMPTY}; it drifts on with ")
    assert guard.failed == feedback.supply.empty.words
    assert not applied[-1].any()
    assert guard.watchdog.trips == 0
    speed = np.linalg.norm(states[-1].velocity_in_world)
    assert f"with {speed:.2f} m/s (x " in guard.failed


def test_a_tank_that_is_low_closes_nothing():
    guard, feedback, _, applied = flown("cubesat_8", "go_to_pose_3d", share=0.03, seconds=1.0)
    assert (guard.failed, feedback.supply.empty) == ("", None)
    assert "lasts for" in feedback.supply.warning
    assert applied[-1].any()


def test_one_wrong_reading_of_the_gauge_empties_no_tank():
    feedback, tank = (
        ActuatorFeedback(load_robot("cubesat_8"), moves=False),
        load_robot("cubesat_8").actuators.tank,
    )
    supply = feedback.supply
    for pascal in (*[tank.regulated] * 20, 0.0, *[tank.regulated] * 20):
        supply.see(0.2, {"supply": SimpleNamespace(value=pascal)})
    assert supply.empty is None
    for _ in range(60):
        supply.see(0.2, {"supply": SimpleNamespace(value=0.0)})
    assert supply.empty.words == EMPTY
