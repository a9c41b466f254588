"""Samples at even times: averages of actuators, poses between measurements, times of a clock that begins anew."""

from __future__ import annotations

import numpy as np

from fulmar_bags.decode import NS, Vectors
from fulmar_console.bags.goal_errors import GoalSpan, goal_errors
from fulmar_console.bags.robot_time import robot_time
from fulmar_console.bags.track import poses_at, rate_of, shares_at


def seconds(values):
    return np.round(np.asarray(values) * NS).astype(np.int64)


def test_a_short_pulse_of_a_valve_is_its_share_of_the_sample():
    stamps = seconds(np.arange(0.0, 1.0, 0.01))
    time = robot_time(stamps, stamps, 0.0)
    values = np.zeros((100, 1))
    values[50] = 1.0  # open for 10 ms
    applied = Vectors(("valve",), stamps, stamps, stamps, values, 0)
    times = np.arange(0, 25) / 25.0
    shares = shares_at(times, applied, time, [{"name": "valve", "full": 1.0}])
    assert np.isclose(shares.max(), 0.25) and np.isclose(shares.sum(), 0.25)


def test_actuators_that_are_reported_no_more_are_shown_at_rest():
    stamps = seconds([0.0, 0.1])
    applied = Vectors(("valve",), stamps, stamps, stamps, np.ones((2, 1)), 0)
    odometry = seconds(np.arange(0.0, 5.0, 0.1))
    shares = shares_at(
        np.arange(0, 125) / 25.0, applied, robot_time(odometry, odometry, 0.0), [{"name": "valve"}]
    )
    assert shares[10] == 1.0 and shares[-1] == 0.0


def test_a_pose_lies_between_its_neighbours_and_an_old_one_stays():
    pose = np.zeros((3, 7))
    pose[:, 0], pose[:, 6] = (0.0, 1.0, 2.0), 1.0
    found, age = poses_at(np.array([0.1, 1.5]), np.array([0.0, 0.2, 5.0]), pose)
    np.testing.assert_allclose(found[:, 0], (0.5, 1.0))
    np.testing.assert_allclose(age, (0.1, 1.3))


def test_a_simulation_that_begins_anew_goes_on_by_the_time_of_recording():
    time = robot_time(seconds([10.0, 11.0, 1.0, 2.0]), seconds([100.0, 101.0, 104.0, 105.0]), 0.0)
    np.testing.assert_allclose(time.t_s, (0.0, 1.0, 4.0, 5.0))


def test_errors_are_those_of_the_goal_that_counts():
    pose = np.zeros((4, 7))
    pose[:, 6] = 1.0
    spans = [GoalSpan(1.0, (3.0, 4.0, 0.0, 0, 0, 0, 1)), GoalSpan(2.5, (0.0, 1.0, 9.0, 0, 0, 0, 1))]
    found = goal_errors(np.arange(4.0), pose, np.zeros((4, 6)), spans, form="pose", moves=False)
    np.testing.assert_allclose(found, (np.nan, 5.0, 5.0, 1.0))


def test_long_recordings_are_sampled_less_often():
    assert rate_of(300.0, 10) == 25.0
    assert rate_of(10 * 3600.0, 10) < 1.0
