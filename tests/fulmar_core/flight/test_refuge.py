"""The safe controller of an aircraft: level wings and a slow descent, from wherever the controller left it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.attitude import euler_of, from_euler
from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.episode import draw_episode
from fulmar_core.flight.refuge import refuge_of
from fulmar_core.flight.trim import find_trim, flying_at
from fulmar_core.robot import load_robot
from fulmar_core.spatial import SpatialState
from fulmar_core.tasks import load_task
from sim_nodes.mock_backend import MockBackend

ROBOT = load_robot("airship_v7")
TASK = load_task("fly_hold").fitted(ROBOT)


def left_alone(height: float, roll: float):
    """Bank [rad], vertical velocity [m/s] and height [m] at 100 Hz after the controller died."""
    quat = [float(part) for part in from_euler(np.asarray(roll), np.asarray(0.0), np.asarray(0.4))]
    start = flying_at(ROBOT, np.array([0.0, 0.0, height, *quat]))
    drawn = draw_episode(ROBOT, TASK, load_scenario("nominal"), seed=3, number=0)
    backend = MockBackend(ROBOT, things=TASK.things)
    sample = backend.reset(replace(drawn, start=start), seed=3)
    refuge, last = refuge_of(ROBOT), find_trim(ROBOT, ROBOT.airframe.speed, height).command
    rows = []
    for step in range(2000):
        last = refuge.command(0.01 * step, last, sample.truth)
        sample = backend.step(last, 1)
        now = SpatialState.from_rigid(sample.truth)[None]
        if float(now.z[0]) + ROBOT.hull_span[0] <= 0.02:
            break
        rows.append((float(euler_of(now.quat)[0][0]), float(now.vz[0]), float(now.z[0])))
    return np.array(rows)


@pytest.mark.parametrize("height", [1.0, pytest.param(5.0, marks=pytest.mark.slow)])
def test_a_craft_whose_controller_died_comes_down_with_level_wings_and_slowly(height):
    bank, climb, heights = left_alone(height, 0.0).T
    assert np.abs(bank).max() <= math.radians(10.0)
    assert climb.min() >= -1.0
    assert heights[-1] < 0.5 * height


@pytest.mark.slow
def test_a_bank_at_the_moment_of_death_is_taken_out():
    bank, climb, _ = left_alone(5.0, math.radians(8.0)).T
    assert np.abs(bank).max() <= math.radians(10.0)
    assert np.abs(bank[500:]).max() <= math.radians(2.0)
    assert climb.min() >= -1.0


def test_without_a_measured_state_throttles_are_idle():
    np.testing.assert_array_equal(
        refuge_of(ROBOT).command(0.0, np.ones(5), None), ROBOT.actuators.safe_command
    )
