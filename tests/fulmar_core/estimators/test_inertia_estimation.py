"""The inertia of satellites from wheels and gyroscope, and what cannot be observed of it."""

from __future__ import annotations

from copy import deepcopy

import numpy as np
import pytest
from filterpy.kalman import ExtendedKalmanFilter

from fulmar_core.estimators.inertia.batch import batch_fit
from fulmar_core.estimators.inertia.ekf import OWN as BESIDE
from fulmar_core.estimators.inertia.ekf import EkfSettings, InertiaFilter, kalman_update
from fulmar_core.estimators.inertia.estimator import InertiaEstimator
from fulmar_core.estimators.inertia.momentum_balance import cumulated, is_body, numbers_of, tensor_of
from fulmar_core.estimators.kinds import load_estimator
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.imu import ImuSample
from fulmar_core.robots.sensors.wheels import WheelSpeeds
from fulmar_core.simulation import satellite_runs
from fulmar_core.simulation.satellite_runs import WHEEL_STD, measured, simulate
from fulmar_core.tasks.torque_profiles import OWN, PROFILES, gain_of, profile_of
from fulmar_core.wires.reading import Reading

MICROSAT = load_robot("microsat")
WHEELS, INERTIA = MICROSAT.actuators, np.array(MICROSAT.body.inertia)
NAMES = WHEELS.wheel_names
SECOND = 1_000_000_000


@pytest.fixture(scope="module")
def runs():
    """A microsatellite under three profiles."""
    return simulate("microsat", ("chirp", "one_step", OWN))


@pytest.fixture(scope="module")
def at_rest(runs):
    """An estimator that has received nothing but noise for three minutes."""
    return TestEstimator().fed(runs["one_step"], seconds=290.0)


class TestProfiles:
    """Excitation."""

    @pytest.mark.parametrize("robot", ["cubesat_wheels", "microsat", "smallsat"])
    @pytest.mark.parametrize("name", PROFILES)
    def test_wheels_do_not_saturate_unless_asked(self, robot, name):
        wheels = load_robot(robot).actuators
        profile = profile_of(name, wheels, gain=gain_of(robot, wheels))
        torque = profile.torque(np.arange(0.0, 300.0, 0.1))
        momentum = np.cumsum(0.1 * torque, axis=0)
        assert not profile.saturates
        assert np.abs(torque).max() <= wheels.torque * (1.0 + 1e-9)
        assert np.abs(momentum).max() <= 0.95 * wheels.top_momentum
        assert np.abs(torque).max() > 1e-3 * wheels.torque

    def test_the_study_s_amplitudes_saturate_those_that_it_says(self):
        cubesat = load_robot("cubesat_wheels").actuators
        for name in ("sine", "prbs", "one_step", "sine_3axis"):
            assert profile_of(name, cubesat, gain=1.0, saturate=True).saturates
        peak = profile_of("sine_3axis", cubesat, gain=1.0, saturate=True).torque(25.0)
        np.testing.assert_allclose(peak, [0.03, 0.015, 0.025], rtol=1e-12)

    def test_a_seed_decides_the_binary_sequence(self):
        one, two = (profile_of("prbs", WHEELS, gain=1.0, seed=s).torque(np.arange(300.0)) for s in (1, 2))
        assert np.abs(one - two).max() > 0.0

    def test_one_time_is_one_row(self):
        profile = profile_of("chirp", WHEELS, gain=1.0)
        np.testing.assert_array_equal(profile.torque(12.0), profile.torque(np.array([12.0]))[0])


class TestBatch:
    """Least squares on the balance of momentum."""

    def test_it_finds_the_tensor_of_a_run_without_noise(self, runs):
        run = runs[OWN]
        fit = batch_fit(run.rate, WHEELS.spin_inertia * run.speeds, run.times, count=6)
        np.testing.assert_allclose(fit.numbers[:3], INERTIA, rtol=1e-4)
        np.testing.assert_allclose(fit.numbers[3:], 0.0, atol=1e-3)

    @pytest.mark.parametrize(("level", "limit"), [("fine", 1e-3), ("low_cost", 1e-2)])
    def test_it_meets_the_limits_with_noise(self, runs, level, limit):
        for name, run in runs.items():
            rate, speeds = measured(run, level, np.random.default_rng(3))
            fit = batch_fit(rate, WHEELS.spin_inertia * speeds, run.times, count=3)
            assert np.abs(fit.numbers / INERTIA - 1.0).max() < limit, name
            assert np.sqrt(np.diag(fit.covariance)).max() < limit * INERTIA.max()

    def test_outliers_of_the_gyroscope_count_little(self, runs):
        rate, speeds = measured(runs[OWN], "fine", np.random.default_rng(4))
        rate[::50] += 0.01
        fit = batch_fit(rate, WHEELS.spin_inertia * speeds, runs[OWN].times, count=3)
        assert np.abs(fit.numbers / INERTIA - 1.0).max() < 0.02

    def test_too_few_samples_are_one_line(self):
        with pytest.raises(ValueError, match=r"10 samples last 1 s; at least 8 s are needed"):
            batch_fit(np.zeros((10, 3)), np.zeros((10, 3)), 0.1 * np.arange(10), count=3)

    def test_the_balance_is_exact_for_rates_that_change_linearly(self):
        times = np.linspace(0.0, 2.0, 5)
        rate = np.outer(times, [0.1, -0.2, 0.05]) + np.array([0.0, 0.1, 0.0])
        momentum = np.outer(times, [0.3, 0.0, -0.1])
        left, right = cumulated(rate, momentum, times, 6)
        fine = np.linspace(0.0, 2.0, 20_001)
        many = np.outer(fine, [0.1, -0.2, 0.05]) + np.array([0.0, 0.1, 0.0])
        left_fine, right_fine = cumulated(many, np.outer(fine, [0.3, 0.0, -0.1]), fine, 6)
        np.testing.assert_allclose(left[-1], left_fine[-1], atol=1e-8)
        np.testing.assert_allclose(right[-1], right_fine[-1], atol=1e-8)


class TestFilter:
    """The extended Kalman filter."""

    def test_its_correction_is_filterpy_s_on_the_same_matrices(self):
        rng = np.random.default_rng(1)
        theirs = ExtendedKalmanFilter(dim_x=9, dim_z=3)
        root = rng.standard_normal((9, 9))
        x, P, H = rng.standard_normal(9), root @ root.T, rng.standard_normal((3, 9))
        F, Q, R = rng.standard_normal((9, 9)), np.eye(9), 0.1 * np.eye(3)
        theirs.x, theirs.P, theirs.F, theirs.Q, theirs.R = x.copy(), P.copy(), F, Q, R
        theirs.predict()
        z = rng.standard_normal(3)
        theirs.update(z, lambda _x: H, lambda state: H @ state)
        predicted, spread = F @ x, F @ P @ F.T + Q
        ours, covariance, _ = kalman_update(predicted, spread, z - H @ predicted, H, R)
        np.testing.assert_allclose(ours, theirs.x, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(covariance, theirs.P, rtol=1e-12, atol=1e-9)

    def test_frozen_states_stay_as_they_are(self):
        rng = np.random.default_rng(2)
        x, H = rng.standard_normal(5), rng.standard_normal((2, 5))
        after, covariance, _ = kalman_update(x, np.eye(5), np.ones(2), H, np.eye(2), frozen=np.array([1, 4]))
        assert (after[[1, 4]] == x[[1, 4]]).all()
        assert (after[[0, 2, 3]] != x[[0, 2, 3]]).all()
        assert np.linalg.eigvalsh(covariance)[0] > 0.0

    def filtered(self, run, level="fine", seconds=300.0):
        std = {"fine": 1e-6, "low_cost": 1e-4}[level]
        found = InertiaFilter(0.85 * INERTIA, EkfSettings(std, WHEELS.spin_inertia * WHEEL_STD))
        rate, speeds = measured(run, level, np.random.default_rng(5))
        for k in np.flatnonzero(run.times <= seconds):
            found.add(rate[k], WHEELS.spin_inertia * speeds[k], float(run.times[k]))
        return found

    @pytest.mark.parametrize("name", ["chirp", "one_step", OWN])
    def test_it_knows_a_static_inertia_after_a_run(self, runs, name):
        assert np.abs(self.filtered(runs[name], seconds=120.0).numbers / INERTIA - 1.0).max() < 0.02

    def test_wheels_that_only_show_noise_teach_it_nothing(self, runs):
        """A profile that ends after 100 s: what was learned stays, and is known ever less."""
        early, late = (self.filtered(runs["one_step"], seconds=s) for s in (110.0, 240.0))
        np.testing.assert_allclose(late.numbers, early.numbers, rtol=1e-3)
        assert late.covariance[0, 0] > 1.5 * early.covariance[0, 0]
        assert not late.excited.any()

    def test_a_step_is_seen_in_its_first_seconds(self, monkeypatch):
        monkeypatch.setattr(satellite_runs, "LASTS_S", 90.0)  # the step comes halfway
        run = simulate("microsat", ("chirp",), change="step")["chirp"]
        before, after = (self.filtered(run, seconds=s).numbers for s in (45.0, 90.0))
        assert np.abs(before / INERTIA - 1.0).max() < 0.03
        assert (after > before).all()

    @pytest.mark.slow
    def test_a_step_of_a_tenth_is_found_within_a_minute(self):
        run = simulate("microsat", ("chirp",), change="step")["chirp"]
        assert np.abs(self.filtered(run, seconds=210.0).numbers / (1.1 * INERTIA) - 1.0).max() < 0.03

    def test_an_impossible_inertia_makes_it_forget(self):
        found = InertiaFilter(INERTIA, EkfSettings(1e-6, 1e-6))
        found.x[BESIDE] = 1000.0
        found.add(np.zeros(3), np.zeros(3), 0.0)
        found.add(np.zeros(3), np.zeros(3), 0.1)
        assert found.numbers[0] <= 20.0 * INERTIA[0]
        assert found.covariance[0, 0] > 0.01 * INERTIA[0] ** 2


class TestEstimator:
    """The same as readings come."""

    def fed(self, run, name="inertia", *, seconds=120.0, level="fine"):
        estimator = InertiaEstimator(load_estimator(name), MICROSAT)
        rate, speeds = measured(run, level, np.random.default_rng(6))
        for k in np.flatnonzero(run.times <= seconds):
            stamp = SECOND + round(1e9 * run.times[k])
            assert estimator.take("imu", Reading(ImuSample(np.zeros(3), rate[k]), stamp)) is None
            assert estimator.take("wheels", Reading(WheelSpeeds(NAMES, speeds[k]), stamp)) is None
        return estimator

    @pytest.mark.parametrize("name", ["inertia", "inertia_batch"])
    def test_it_publishes_a_tensor_with_its_covariance(self, runs, name):
        estimate = self.fed(runs[OWN], name).estimate()
        np.testing.assert_allclose(np.diag(estimate.value), INERTIA, rtol=0.01)
        assert estimate.covariance.shape == (6, 6)
        assert np.linalg.eigvalsh(estimate.covariance)[0] >= 0.0

    def test_what_is_not_excited_is_withheld_and_named(self, at_rest):
        estimator = deepcopy(at_rest)
        assert estimator.estimate() is None
        assert "cannot be observed" in estimator.problem
        assert "cannot be observed" in estimator.status()["i_xx"]

    def test_saturated_wheels_are_named(self, at_rest):
        estimator = deepcopy(at_rest)
        full = np.array([WHEELS.top_speed, 0.0, 0.0])
        estimator.take("wheels", Reading(WheelSpeeds(NAMES, full), SECOND + 291 * SECOND))
        assert estimator.saturated == ("wheel_x",)
        estimator.estimate()
        assert "wheel_x at top speed" in estimator.problem

    @pytest.mark.parametrize(
        ("name", "value", "said"),
        [
            ("imu", ImuSample(np.zeros(3), np.array([0.0, np.nan, 0.0])), "not finite"),
            ("imu", ImuSample(np.zeros(3), np.array([9.0, 0.0, 0.0])), "beyond what is possible"),
            ("wheels", WheelSpeeds(("other",), np.zeros(1)), "wheel_x, wheel_y, wheel_z are missing"),
            ("wheels", WheelSpeeds(NAMES, np.array([np.nan, 0.0, 0.0])), "not finite"),
            ("mocap", None, "not known here"),
        ],
    )
    def test_bad_readings_are_refused_in_words(self, runs, name, value, said):
        estimator = self.fed(runs[OWN], seconds=20.0)
        assert said in estimator.take(name, Reading(value, SECOND + 30 * SECOND))

    def test_an_inertia_that_no_body_can_have_is_withheld(self, runs):
        estimator = self.fed(runs[OWN])
        estimator._ekf.x[BESIDE] *= 3.0  # more than the other two together
        assert estimator.estimate() is None
        assert "no body has the inertia" in estimator.problem

    def test_a_jump_of_time_begins_a_new_epoch(self, runs):
        estimator = self.fed(runs[OWN], seconds=20.0)
        reading = Reading(ImuSample(np.zeros(3), np.zeros(3)), 4000 * SECOND)
        assert "jumped" in estimator.take("imu", reading)
        assert (estimator.epoch, estimator.estimate()) == (1, None)


def test_tensors_and_their_numbers_are_two_ways_round():
    numbers = np.array([3.0, 2.5, 2.0, 0.1, -0.2, 0.05])
    np.testing.assert_array_equal(numbers_of(tensor_of(numbers), 6), numbers)
    assert is_body(tensor_of(numbers))
    assert not is_body(np.diag([1.0, 1.0, 2.5]))
    assert not is_body(np.diag([1.0, -1.0, 1.0]))
    assert not is_body(np.diag([np.nan, 1.0, 1.0]))
