"""Runs cut into windows."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_evaluation.identification.drives import cut, drive_of


def drive(t, *, yaw=None):
    xy = np.stack((1.0 + 0.5 * t + 0.1 * t**2, 0.0 * t), axis=1)
    return drive_of(
        "run", t, np.column_stack((xy, 0.0 * t if yaw is None else yaw)), np.array([0.0]), np.zeros((1, 2))
    )


def test_windows_fill_a_run_and_leave_the_rest():
    windows = cut([drive(np.arange(0.0, 10.5, 0.1))], length_s=4.0, dt=0.02)
    assert len(windows) == 2
    assert windows.begin_s.tolist() == [0.0, 4.0]
    assert windows.valid.sum(axis=1).tolist() == [41, 41]


def test_their_first_states_are_those_of_the_run():
    windows = cut([drive(np.arange(0.0, 10.5, 0.1))], length_s=4.0, dt=0.02)
    np.testing.assert_allclose(windows.first_states()[[0, 3], 1], [1.0 + 2.0 + 1.6, 0.5 + 0.8], atol=1e-9)


def test_predictions_are_compared_at_the_times_of_the_measurements():
    windows = cut([drive(np.array([0.0, 0.013, 0.3, 0.777, 1.5, 2.0]))], length_s=2.0, dt=0.02)
    grid = np.arange(101)[:, None, None, None] * 0.02 * np.ones((1, 3, 2, 1))
    seen = windows.at_measurements(grid)
    assert seen.shape == (2, 1, 6, 3)
    np.testing.assert_allclose(seen[1, 0, :, 2], [0.0, 0.013, 0.3, 0.777, 1.5, 2.0], atol=1e-12)


def test_headings_do_not_jump_at_a_half_turn():
    t = np.arange(0.0, 5.0, 0.05)
    wrapped = np.angle(np.exp(1j * 2.0 * t))
    np.testing.assert_allclose(drive(t, yaw=wrapped).pose[:, 2], 2.0 * t, atol=1e-9)


def test_a_run_that_is_too_short_is_refused_with_what_to_do():
    with pytest.raises(ConfigError, match=r"the longest of 1 runs has 1\.0 s; at least 4 s") as error:
        cut([drive(np.linspace(0.0, 1.0, 50))], length_s=4.0, dt=0.02)
    assert "--controller excite" in str(error.value)


def test_a_bag_without_commands_or_with_broken_poses_is_refused():
    t = np.arange(0.0, 5.0, 0.05)
    with pytest.raises(ConfigError, match="100 poses and 0 commands"):
        drive_of("run", t, np.zeros((100, 3)), np.zeros(0), np.zeros((0, 2)))
    with pytest.raises(ConfigError, match="not finite"):
        drive(t, yaw=np.full(100, np.nan))
