"""A world by itself is measured as among others, to the bit, though its random numbers are drawn ahead."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors import odometer
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario

RUNS = [
    ("floating_platform", "go_to_pose", "drift_training"),
    ("floating_platform", "go_to_pose", "lab_mocap"),
    ("spacecraft_16", "go_to_pose_3d", "randomised"),
]
STEPS = odometer.AHEAD + 6


def build(robot, task, scenario, worlds):
    robot = load_robot(robot)
    return BatchSimulation(
        robot, load_task(task).fitted(robot), load_scenario(scenario), worlds=worlds, seed=7
    )


def measured(simulation):
    return np.stack(simulation.measured.columns())


@pytest.mark.parametrize("run", RUNS)
def test_a_lone_world_is_measured_as_among_others(run, monkeypatch):
    draws, calls = np.random.default_rng(1), []
    lone, many = build(*run, 1), build(*run, 3)
    usual = odometer.words
    monkeypatch.setattr(odometer, "words", lambda *given: calls.append(given[1]) or usual(*given))
    scale = many.robot.actuators.scale
    for step in range(STEPS):
        command = draws.uniform(-1.0, 1.0, (3, len(scale))) * scale
        lone.step(command[:1])
        many.step(command)
        if step == STEPS - 10:
            for each in (lone, many):
                each.reset([0])
        np.testing.assert_array_equal(measured(lone), measured(many)[:, :1])
    ahead = [counter for counter in calls if np.size(counter) == odometer.AHEAD]
    assert len(ahead) <= 4  # three blocks, one of them after the reset, in the place of a call each step
    assert sum(np.size(counter) == 1 and np.ndim(counter) == 1 for counter in calls) == 0


def test_a_simulation_that_goes_on_from_another_draws_its_own_numbers():
    one, other = (build(*RUNS[2], 1) for _ in range(2))
    command = np.zeros((1, len(one.robot.actuators.scale)))
    for _ in range(5):
        one.step(command)
    state = one.snapshot()
    one.step(command)
    other.restore(state)
    other.step(command)
    np.testing.assert_array_equal(measured(one), measured(other))
