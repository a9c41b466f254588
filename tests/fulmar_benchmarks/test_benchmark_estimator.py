"""The estimator beside the mean of 30 poses."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fulmar_core.estimators.kinds import load_estimator
from fulmar_core.robots.robot_file import load_robot
from tests.benchmarks.estimator.comparison import (
    DELAY_LIMIT_S,
    MEAN,
    POSES,
    RATES_HZ,
    RMSE_SHARE_LIMIT,
    WITH_IMU,
    ThirtyPoses,
    compare,
    estimate_by_mean,
    requirements_met,
)
from tests.benchmarks.estimator.drive import TICK_S, Drive, drives

pytest.importorskip("filterpy")
ROBOT = load_robot("floating_platform")


def steady_drive(seconds: float) -> Drive:
    """A body at 0.2 m/s along x, measured without noise."""
    time_s = TICK_S * np.arange(1, round(seconds / TICK_S) + 1)
    still = np.zeros_like(time_s)
    place = np.stack((0.2 * time_s, still, still), axis=-1)
    motion = np.stack((still + 0.2, still, still), axis=-1)
    return Drive(time_s, place, motion, place, np.zeros((len(time_s), 3)), still)


def test_the_mean_of_thirty_poses_is_a_thirtieth_too_fast_as_published():
    mean = ThirtyPoses()
    for k in range(POSES):
        mean.see_pose(0.04 * k, np.array([0.2 * 0.04 * k, 0.0, 0.0]))
    assert mean.motion()[0] == pytest.approx(0.2 * 30 / 29)


def test_the_mean_states_nothing_before_its_buffer_is_full():
    reported = estimate_by_mean(steady_drive(2.0), 8, 0.0)
    assert np.isnan(reported[8 * 28]).all()
    assert np.isfinite(reported[8 * 30]).all()


@pytest.mark.slow
def test_the_estimator_is_at_least_twice_as_good_and_less_than_20_ms_late_at_both_rates():
    driven = drives(ROBOT, count=1, seconds=15.0, seed=3)
    settings = dataclasses.replace(load_estimator("mocap_imu"), latency_s=0.01)
    found = compare(driven, settings, ROBOT.limits, 0.01, lambda: None)
    by = {(row.method, row.pose_rate_hz): row for row in found}
    for rate_hz in RATES_HZ:
        ours, mean = by[WITH_IMU, rate_hz], by[MEAN, rate_hz]
        assert ours.velocity_rmse_m_s <= RMSE_SHARE_LIMIT * mean.velocity_rmse_m_s
        assert abs(ours.delay_ms) < 1e3 * DELAY_LIMIT_S
    # And the mean is as late as its window says: half of 29 differences, and the latency.
    assert by[MEAN, 200.0].delay_ms == pytest.approx(72.5 + 10.0, abs=10.0)
    assert by[MEAN, 25.0].delay_ms == pytest.approx(580.0 + 20.0 + 10.0, abs=90.0)
    assert all(line["passed"] for line in requirements_met(found))


def test_the_result_says_no_when_the_estimator_is_no_better():
    driven = drives(ROBOT, count=1, seconds=6.0, seed=3)
    found = compare(driven, load_estimator("mocap_imu"), ROBOT.limits, 0.0, lambda: None)
    worse = [dataclasses.replace(row, velocity_rmse_m_s=1.0) for row in found]
    assert not any(line["passed"] for line in requirements_met(worse))
