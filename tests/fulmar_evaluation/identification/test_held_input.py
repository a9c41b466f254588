"""What actuators did during each step depends smoothly on their delay."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_evaluation.identification.drives import cut, drive_of
from fulmar_evaluation.identification.held_input import followed, late_events, mean_over_steps, ramped

DT = 0.02


def held(delay):
    switch_s, command = np.array([0.0, 0.1, 0.2]), np.array([[0.0], [1.0], [0.0]])
    event_s, change = late_events(switch_s, command, delay)
    return mean_over_steps(event_s, change, np.array([0.0]), steps=20, dt=DT)[:, 0, 0]


def test_a_delay_of_whole_steps_shifts_the_input():
    assert held(0.0).tolist() == pytest.approx([0.0] * 5 + [1.0] * 5 + [0.0] * 10)
    assert held(2 * DT).tolist() == pytest.approx([0.0] * 7 + [1.0] * 5 + [0.0] * 8)


@pytest.mark.parametrize("delay", [-0.013, 0.0, 0.007, 0.031])
def test_no_delay_adds_or_takes_any_of_it(delay):
    assert held(delay).sum() * DT == pytest.approx(0.1)


def test_it_has_a_slope_between_whole_steps():
    np.testing.assert_allclose(held(0.005), 0.75 * held(0.0) + 0.25 * held(DT), atol=1e-12)


def test_slow_actuators_ramp_and_remember_what_came_before_a_window():
    t = np.arange(0.0, 4.0 + DT / 2, DT)
    drive = drive_of("ramp", t, np.zeros((len(t), 3)), np.array([0.5]), np.array([[1.0]]))
    windows = cut([drive], length_s=1.0, dt=DT)
    applied = followed(windows, 0.1, (0.5,))[:, 0, :]
    assert applied.shape == (50, 4)
    assert applied[:, 0].max() == pytest.approx(0.5 * 0.4, abs=1e-9)
    assert applied[0, 1] == pytest.approx(0.5 * (0.4 + DT), abs=1e-9)
    assert applied[-1, 3] == pytest.approx(1.0)


def test_a_staircase_as_fast_as_an_actuator_can_go_still_shows_its_delay():
    """Commands are limited to the slew of the actuators, so that their steps join to one ramp without a flat part."""
    switch_s, wanted = np.arange(0.0, 1.0, 0.1), 0.1 * np.arange(1.0, 11.0)
    t = np.arange(0.0, 2.0 + DT / 2, DT)
    drive = drive_of("stairs", t, np.zeros((len(t), 3)), switch_s, wanted[:, None])
    windows = cut([drive], length_s=2.0, dt=DT)
    early, late = (followed(windows, delay, (1.0,))[:, 0, 0] for delay in (0.005, 0.006))
    ramp = (early > 0.0) & (early < 1.0)
    np.testing.assert_allclose((late - early)[ramp], -0.001, atol=1e-9)


def test_a_step_that_is_cut_short_by_the_next_one_is_left_where_it_had_got_to():
    times, values = ramped(np.array([0.0, 0.5, 0.6]), np.array([1.0, -1.0, 0.0]), 1.0)
    assert times.tolist() == pytest.approx([0.0, 0.5, 0.5, 0.6, 0.6, 1.0])
    assert values.tolist() == pytest.approx([0.0, 0.5, 0.5, 0.4, 0.4, 0.0])
