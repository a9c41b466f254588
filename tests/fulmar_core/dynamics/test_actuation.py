"""From a command to what an actuator does."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fulmar_core.dynamics.actuators.actuation import ActuationState
from fulmar_core.robots.actuators.response import Response
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.counter_rng import WORLD, Draws
from fulmar_core.worlds.scenario import draw_world, load_scenario

WORLDS, DT = 3, 0.02
ROBOT = load_robot("turtlebot2")
NOMINAL = draw_world(ROBOT, load_scenario("ideal"), Draws(0, np.arange(WORLDS), np.zeros(WORLDS), WORLD))


def actuation(*, binary=False, scale=(1.0, 1.0), delay_ticks=0, **response):
    family = SimpleNamespace(own_response=Response(**response), binary=binary, scale=np.array(scale))
    return ActuationState(family, np.zeros((2, WORLDS)), delay_ticks=delay_ticks)


def full(value=1.0):
    return np.full((2, WORLDS), value)


def course(state, steps, *, latest_s=0.0):
    """What the first actuator of the first world does at each of some steps."""
    return [float(state.advance(DT, latest_s=latest_s)[0, 0]) for _ in range(steps)]


def test_without_a_response_of_its_own_an_actuator_applies_its_command_at_once():
    state = actuation()
    state.begin(full(), NOMINAL, None)
    assert course(state, 2) == [1.0, 1.0]


def test_before_the_delay_is_over_the_command_before_goes_on():
    state = actuation(delay_s=0.04)
    state.begin(full(0.3), NOMINAL, None)
    assert course(state, 4, latest_s=1.0) == [0.0, 0.0, 0.3, 0.3]
    state.begin(full(0.7), NOMINAL, None)
    assert course(state, 4, latest_s=1.0) == [0.3, 0.3, 0.7, 0.7]


def test_a_world_s_own_delay_comes_on_top():
    state = actuation(delay_s=0.02)
    state.begin(full(), replace(NOMINAL, action_delay=np.array([0.0, 0.02, 0.04])), None)
    seen = np.array([state.advance(DT, latest_s=1.0)[0] for _ in range(4)])
    assert seen.sum(axis=0).tolist() == [3.0, 2.0, 1.0]


def test_delays_longer_than_a_control_step_play_every_command_later():
    state = actuation(delay_ticks=4, delay_s=0.02)
    late = replace(NOMINAL, action_delay=np.array([0.0, 0.02, 0.06]))
    seen = []
    for command in range(1, 6):
        state.begin(full(float(command)), late, None)
        seen += [state.advance(DT, latest_s=0.08)[0].tolist() for _ in range(2)]
    given = np.repeat(np.arange(1.0, 6.0), 2)
    for world, ticks in enumerate((1, 2, 4)):
        assert [row[world] for row in seen] == [0.0] * ticks + given[:-ticks].tolist()


def test_a_world_brought_back_has_no_commands_of_before_on_their_way():
    state = actuation(delay_ticks=2, delay_s=0.04)
    state.begin(full(), NOMINAL, None)
    state.reset(np.array([1]), np.zeros((2, 1)))
    seen = np.array([state.advance(DT, latest_s=0.04)[0] for _ in range(3)])
    assert seen.T.tolist() == [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]


def test_valves_open_late_and_close_at_once():
    state = actuation(binary=True, delay_s=0.02)
    late = replace(NOMINAL, opening_delay=np.full(WORLDS, 0.04))
    state.begin(full(), late, None)
    assert course(state, 5, latest_s=1.0) == [0.0, 0.0, 0.0, 1.0, 1.0]
    state.begin(full(), late, None)  # what is open stays open
    assert course(state, 3, latest_s=1.0) == [1.0, 1.0, 1.0]
    state.begin(full(0.0), late, None)
    assert course(state, 3, latest_s=1.0) == [1.0, 0.0, 0.0]


def test_slew_bounds_how_fast_an_actuator_changes_each_with_its_own_rate():
    state = actuation(slew=(5.0, 10.0))
    state.begin(full(), NOMINAL, None)
    seen = np.array([state.advance(DT, latest_s=0.0)[:, 0] for _ in range(12)])
    np.testing.assert_allclose(seen[:, 0], np.minimum(1.0, 0.1 * np.arange(1, 13)), atol=1e-12)
    np.testing.assert_allclose(seen[:, 1], np.minimum(1.0, 0.2 * np.arange(1, 13)), atol=1e-12)


def test_a_lag_takes_the_same_share_of_the_way_at_every_step():
    state = actuation(lag_s=0.1)
    state.begin(full(), NOMINAL, None)
    np.testing.assert_allclose(course(state, 10), 1.0 - 0.8 ** np.arange(1, 11), atol=1e-12)


def test_an_actuator_that_failed_stays_as_if_it_were_safe():
    state = actuation()
    state.begin(full(), replace(NOMINAL, alive=np.array([[0.0, 1.0, 1.0], [1.0, 1.0, 0.0]])), full())
    assert state.advance(DT, latest_s=0.0).tolist() == [[0.0, 1.0, 1.0], [1.0, 1.0, 0.0]]


@pytest.mark.parametrize("scale", [(1.0, 1.0), (0.45, 4.0)])
def test_errors_of_continuous_actuators_are_shares_of_full_command(scale):
    state = actuation(scale=scale)
    noisy = replace(NOMINAL, action_noise=np.full(WORLDS, 0.05))
    state.begin(full(0.2), noisy, np.array([[-1.0, 0.0, 1.0]] * 2))
    error = state.advance(DT, latest_s=0.0) - 0.2
    np.testing.assert_allclose(error, 0.05 * np.outer(scale, [-1.0, 0.0, 1.0]), atol=1e-12)


def test_errors_of_valves_are_in_their_thrust_and_not_in_whether_they_open():
    state = actuation(binary=True)
    noisy = replace(NOMINAL, action_noise=np.full(WORLDS, 0.05))
    state.begin(full(), noisy, np.array([[-1.0, 0.0, 1.0]] * 2))
    assert state.advance(DT, latest_s=0.0).tolist() == full().tolist()
    np.testing.assert_allclose(state.gain, [[0.95, 1.0, 1.05]] * 2, atol=1e-12)


def test_worlds_brought_back_are_safe_and_the_others_go_on():
    state = actuation(slew=(5.0, 5.0))
    state.begin(full(), NOMINAL, None)
    state.advance(DT, latest_s=0.0)
    kept = state.applied
    state.reset(np.array([1]), np.zeros((2, 1)))
    assert state.applied[0].tolist() == pytest.approx([0.1, 0.0, 0.1])
    assert kept[0].tolist() == pytest.approx([0.1, 0.1, 0.1])  # what was handed out does not change
