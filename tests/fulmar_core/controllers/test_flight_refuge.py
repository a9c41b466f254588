"""The safe controller of an aircraft: level wings and a slow descent, from wherever the controller left it."""

from __future__ import annotations

import copy
import math
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.controllers.flight_refuge import BLIND, DESCENDS, HOLD_S, HOLDS, refuge_of
from fulmar_core.dynamics.flight_trim import find_trim, flying_at
from fulmar_core.robots.actuators.refuge import DOWN
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.states.attitude import euler_of, from_euler
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from sim_nodes.mock_backend import MockBackend

ROBOT = load_robot("airship_v7")
TASK = load_task("fly_hold").fitted(ROBOT)


def left_alone(height: float, roll: float, hz: float = 100.0):
    """Bank [rad], vertical velocity [m/s] and height [m] at a rate after the controller died."""
    quat = [float(part) for part in from_euler(np.asarray(roll), np.asarray(0.0), np.asarray(0.4))]
    start = flying_at(ROBOT, np.array([0.0, 0.0, height, *quat]))
    drawn = draw_episode(ROBOT, TASK, load_scenario("nominal"), seed=3, number=0)
    backend = MockBackend(ROBOT, things=TASK.things)
    sample = backend.reset(replace(drawn, start=start), seed=3)
    refuge, last = refuge_of(ROBOT, hz), find_trim(ROBOT, ROBOT.airframe.speed, height).command
    rows = []
    for step in range(round(20.0 * hz)):
        last = refuge.command(step / hz, last, sample.truth)
        sample = backend.step(last, ROBOT.timing.substeps(hz))
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


TRIM = find_trim(ROBOT, ROBOT.airframe.speed, 1.0)


def at_height(height: float):
    """Level flight, as it is measured."""
    return replace(TRIM.state, z=np.asarray(height)).to_rigid()


@pytest.fixture(scope="module")
def solved():
    """With its gains."""
    return refuge_of(ROBOT, 100.0)


@pytest.fixture
def refuge(solved):
    return copy.deepcopy(solved)


def test_it_holds_its_height_then_descends_and_says_so(refuge):
    last = TRIM.command
    refuge.command(0.0, last, at_height(1.0))
    refuge.command(HOLD_S, last, at_height(1.0))
    assert refuge.doing == HOLDS
    refuge.command(HOLD_S + 0.01, last, at_height(1.0))
    assert refuge.doing == DESCENDS


def test_on_the_ground_its_throttles_go_idle_and_stay_so_through_a_wrong_height(refuge):
    last = TRIM.command
    refuge.command(0.0, last, at_height(0.5))
    for step in range(200):
        refuge.command(HOLD_S + 0.01 * step, last, at_height(0.4))
    assert refuge.doing == DOWN
    np.testing.assert_array_equal(
        refuge.command(HOLD_S + 3.0, last, at_height(0.6)), ROBOT.actuators.safe_command
    )


def test_one_low_measurement_over_the_water_does_not_stop_its_motors(refuge):
    last = TRIM.command
    for step in range(100):
        refuge.command(HOLD_S + 0.01 * step, last, at_height(0.6))
    command = refuge.command(HOLD_S + 1.0, last, at_height(0.35))
    assert refuge.doing == DESCENDS
    assert command[-1] > 0.0


def test_neither_does_the_first_one_after_a_start_or_after_the_hold(refuge):
    last = TRIM.command
    assert refuge.command(0.0, last, at_height(0.3))[-1] > 0.0
    for step in range(1, 501):
        refuge.command(0.01 * step, last, at_height(0.6))
    assert refuge.command(HOLD_S + 0.01, last, at_height(0.3))[-1] > 0.0
    assert refuge.doing == DESCENDS


def test_a_craft_that_is_on_the_ground_gets_no_thrust_for_longer_than_it_takes_to_be_sure(refuge):
    last = np.zeros(5)
    commands = [refuge.command(0.01 * step, last, at_height(0.4)) for step in range(31)]
    assert refuge.doing == DOWN
    np.testing.assert_array_equal(commands[-1], ROBOT.actuators.safe_command)


@pytest.mark.slow
def test_it_comes_down_softly_where_it_is_asked_at_every_command_of_a_slow_controller():
    bank, climb, heights = left_alone(1.0, 0.0, hz=25.0).T
    assert np.abs(bank).max() <= math.radians(10.0)
    assert climb.min() >= -1.0
    assert heights[-1] < 0.5


def test_a_second_failure_begins_anew_from_where_the_craft_is_then(refuge, solved):
    fresh = copy.deepcopy(solved)
    for since_s in (0.0, 0.01):
        refuge.command(since_s, TRIM.command, at_height(1.0))
    for since_s in (0.0, 0.01):
        again = refuge.command(since_s, TRIM.command, at_height(3.0))
        np.testing.assert_array_equal(again, fresh.command(since_s, TRIM.command, at_height(3.0)))


def test_without_a_measured_state_throttles_are_idle(refuge):
    np.testing.assert_array_equal(refuge.command(0.0, np.ones(5), None), ROBOT.actuators.safe_command)
    assert refuge.doing == BLIND
