"""What actuators did during each step depends smoothly on their delay."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.identification.drive import drive_of
from fulmar_core.identification.held_input import followed, late_events, mean_over_steps
from fulmar_core.identification.windows import cut

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
    drive = drive_of("ramp", t, np.zeros((len(t), 2)), np.zeros(len(t)), np.array([0.5]), np.array([[1.0]]))
    windows = cut([drive], length_s=1.0, dt=DT)
    applied = followed(windows, 0.1, (0.5,))[:, 0, :]
    assert applied.shape == (50, 4)
    assert applied[:, 0].max() == pytest.approx(0.5 * 0.4, abs=1e-9)
    assert applied[0, 1] == pytest.approx(0.5 * (0.4 + DT), abs=1e-9)
    assert applied[-1, 3] == pytest.approx(1.0)
