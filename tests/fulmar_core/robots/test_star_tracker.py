"""The star tracker: noise about its axes, mounting, rate, delay and losses, each by itself."""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fulmar_core.robots.sensors.kind import Truth
from fulmar_core.robots.sensors.star_tracker import KIND, StarTracker, StarTrackerSpec
from fulmar_core.states.state import RigidBodyState

TILTED = Rotation.from_euler("zyx", (40.0, -20.0, 10.0), degrees=True)


def truth(attitude=TILTED):
    return Truth(RigidBodyState(np.zeros(3), attitude.as_quat(), np.zeros(3), np.zeros(3)))


def begun(spec, seed=5, number=0, noisy=True):
    tracker = StarTracker(spec, noisy)
    tracker.reset(seed, number)
    return tracker


def errors(tracker, times):
    """Rotation vectors from true to measured, in the body, (n, 3) [rad]."""
    readings = [tracker.measure(truth(), time) for time in times]
    return np.array(
        [(TILTED.inv() * Rotation.from_quat(each.value)).as_rotvec() for each in readings if each is not None]
    )


def test_without_errors_it_reports_the_truth_as_a_unit_quaternion():
    reading = begun(StarTrackerSpec()).measure(truth(), 0.0)
    np.testing.assert_allclose(reading.value, TILTED.as_quat(), rtol=0, atol=1e-15)
    assert not reading.covariance.any()


def test_it_is_noisier_about_its_boresight_than_across():
    spec = StarTrackerSpec(std=1e-4, boresight_std=8e-4, boresight=(0.0, 3.0, 4.0))
    found = errors(begun(spec), range(4000))
    axis = np.array([0.0, 0.6, 0.8])
    across = np.array([[1.0, 0.0, 0.0], [0.0, 0.8, -0.6]])
    assert (found @ axis).std() == pytest.approx(8e-4, rel=0.05)  # 4,000 numbers: one sigma is 1.1 %
    np.testing.assert_allclose((found @ across.T).std(axis=0), 1e-4, rtol=0.05)


def test_its_covariance_is_that_of_its_errors():
    spec = StarTrackerSpec(std=1e-4, boresight_std=8e-4, boresight=(1.0, 1.0, 0.0))
    tracker = begun(spec)
    stated = tracker.measure(truth(), 0.0).covariance
    found = np.cov(errors(tracker, range(1, 6001)).T)
    np.testing.assert_allclose(found, stated, rtol=0, atol=0.06 * stated.max())


def test_a_mounting_error_stays_for_an_episode_and_differs_between_episodes():
    spec = StarTrackerSpec(bias_std=0.01)
    tracker = begun(spec)
    assert np.ptp(errors(tracker, range(5)), axis=0).max() < 1e-12
    firsts = np.array([errors(begun(spec, number=number), [0.0])[0] for number in range(800)])
    np.testing.assert_allclose(firsts.std(axis=0), 0.01, rtol=0.1)


def test_it_has_a_reading_only_when_there_is_a_new_one():
    times = np.round(np.arange(0.0, 3.0, 0.02), 9)
    tracker = begun(StarTrackerSpec(rate_hz=4.0))
    seen = [time for time in times if tracker.measure(truth(), time) is not None]
    # At 4 Hz: the first tick at or after each quarter of a second.
    np.testing.assert_allclose(seen, np.ceil(np.arange(12) * 0.25 / 0.02 - 1e-9) * 0.02)


def test_a_late_reading_is_of_the_time_when_it_was_measured():
    tracker = begun(StarTrackerSpec(rate_hz=1.0, delay_s=0.3))
    came = {}
    for time in np.round(np.arange(0.0, 2.5, 0.1), 9):
        turned = Rotation.from_euler("z", time)
        if (reading := tracker.measure(truth(turned), time)) is not None:
            came[float(time)] = reading
    assert list(came) == [0.3, 1.3, 2.3]
    for time, reading in came.items():
        assert reading.age_s == pytest.approx(0.3)
        assert reading.stamp(1_000_000_000) == pytest.approx(700_000_000, abs=1)
        assert Rotation.from_quat(reading.value).as_rotvec()[2] == pytest.approx(time - 0.3)


def test_so_many_measurements_are_lost():
    found = errors(begun(StarTrackerSpec(dropout=0.25)), range(4000))
    assert len(found) / 4000 == pytest.approx(0.75, abs=0.03)  # four sigma


def test_without_sensor_noise_it_keeps_its_rate_alone():
    spec = StarTrackerSpec(std=0.1, boresight_std=0.1, bias_std=0.1, rate_hz=1.0, delay_s=0.5, dropout=0.9)
    found = errors(begun(spec, noisy=False), np.arange(0.0, 4.0, 0.5))
    assert found.shape == (4, 3)
    np.testing.assert_allclose(found, 0.0, atol=1e-12)


def test_a_seed_gives_the_same_readings_and_a_copy_goes_on_alike():
    spec = StarTrackerSpec(std=1e-3, boresight_std=5e-3, bias_std=1e-3, delay_s=2.0, dropout=0.2)
    tracker = begun(spec)
    first = errors(tracker, range(50))
    other = copy.deepcopy(tracker)
    np.testing.assert_array_equal(errors(tracker, range(50, 90)), errors(other, range(50, 90)))
    tracker.reset(5, 0)
    np.testing.assert_array_equal(errors(tracker, range(50)), first)
    assert not np.array_equal(errors(begun(spec, seed=6), range(50))[:5], first[:5])


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"std": -1.0}, "must not be negative"),
        ({"rate_hz": -1.0}, "must not be negative"),
        ({"dropout": 1.0}, r"'dropout' = 1 must lie in \[0, 1\)"),
        ({"boresight": (0.0, 0.0, 0.0)}, "is no direction"),
    ],
)
def test_settings_without_meaning_are_refused(wrong, says):
    with pytest.raises(ValueError, match=says):
        replace(StarTrackerSpec(), **wrong)


@pytest.mark.parametrize("value", [(0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 2.0), (np.nan, 0.0, 0.0, 1.0)])
def test_what_is_no_attitude_is_not_written(value):
    reading = replace(begun(StarTrackerSpec()).measure(truth(), 0.0), value=value)
    with pytest.raises(ValueError, match="must be a unit quaternion"):
        KIND.message.write(reading, StarTrackerSpec())
