"""The attitude of a satellite from star tracker, gyroscope, wheels and event rate, and without some of them."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fulmar_core.config.errors import ConfigError
from fulmar_core.estimators.kinds import KINDS, check_estimator, make_estimator
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.imu import ImuSample
from fulmar_core.robots.sensors.wheels import WheelSpeeds
from fulmar_core.wires.reading import Reading

CUBESAT = load_robot("cubesat_wheels")
NAMES = CUBESAT.actuators.wheel_names
SECOND = 1_000_000_000
RATE = np.array([0.0, 0.0, 0.002])  # about a principal axis, so that it stays without a torque [rad/s]
TRACKER_STD = 2.4e-5


def truth(time_s):
    return Rotation.from_rotvec(RATE * time_s).as_quat()


def imu(rate):
    return ImuSample(np.zeros(3), np.asarray(rate))


def fed(estimator, seconds, *, gyroscope=True, tracker=True, rate=False, begin_s=0.0, seed=0):
    """Let an estimator have the readings of a body that turns steadily; returns the last time [ns]."""
    rng = np.random.default_rng(seed)
    for k in range(round(10 * seconds)):
        time_s = begin_s + 0.1 * k
        stamp = SECOND + round(1e9 * time_s)
        wheels = WheelSpeeds(NAMES, 0.01 * rng.standard_normal(3))
        assert estimator.take("wheels", Reading(wheels, stamp)) is None
        if gyroscope:
            reading = Reading(imu(RATE + 1e-6 * rng.standard_normal(3)), stamp)
            assert estimator.take("imu", reading) is None
        if tracker and k % 10 == 0:
            noise = Rotation.from_rotvec(TRACKER_STD * rng.standard_normal(3))
            quat = (Rotation.from_quat(truth(time_s)) * noise).as_quat()
            covariance = TRACKER_STD**2 * np.eye(3)
            assert estimator.take("star_tracker", Reading(quat, stamp, covariance=covariance)) is None
        if rate and k % 2 == 0:
            std = 2e-5
            reading = Reading(RATE + std * rng.standard_normal(3), stamp, covariance=std**2 * np.eye(3))
            assert estimator.take("rate", reading) is None
    return SECOND + round(1e9 * (begin_s + 0.1 * (round(10 * seconds) - 1)))


def off(estimate, stamp_ns):
    """Angle between an estimate and the truth [rad]."""
    there = Rotation.from_quat(truth((stamp_ns - SECOND) / 1e9))
    return float((there.inv() * Rotation.from_quat(estimate.value.quat_xyzw)).magnitude())


def test_it_knows_attitude_and_rate_better_than_the_star_tracker_alone():
    estimator = make_estimator("attitude", CUBESAT)
    assert estimator.estimate() is None
    assert "star tracker" in estimator.problem
    now = fed(estimator, 60.0)
    estimate = estimator.estimate()
    assert estimate.stamp_ns == now
    assert off(estimate, now) < 1.5 * TRACKER_STD  # of three axes together
    np.testing.assert_allclose(estimate.value.angular_velocity_in_body, RATE, atol=2e-6)
    assert np.sqrt(np.diag(estimate.covariance)[3:6]).max() < TRACKER_STD
    assert estimator.status() == {"rate_from": "gyroscope", "lacks": "nothing"}


@pytest.mark.parametrize("rate", [True, False])
def test_it_goes_on_when_the_gyroscope_dies(rate):
    estimator = make_estimator("attitude", CUBESAT)
    fed(estimator, 30.0)
    now = fed(estimator, 60.0, gyroscope=False, rate=rate, begin_s=30.0, seed=1)
    estimate = estimator.estimate(now)
    assert off(estimate, now) < 4.0 * TRACKER_STD
    np.testing.assert_allclose(estimate.value.angular_velocity_in_body, RATE, atol=5e-5)
    assert estimator.rate_source == ("events" if rate else "wheels")


def test_without_the_star_tracker_its_uncertainty_grows_until_it_says_so():
    estimator = make_estimator("attitude", CUBESAT)
    fed(estimator, 10.0)
    fed(estimator, 20.0, gyroscope=False, tracker=False, rate=True, begin_s=10.0)
    early = np.sqrt(np.diag(estimator.estimate().covariance)[3:6]).max()
    fed(estimator, 60.0, gyroscope=False, tracker=False, rate=True, begin_s=30.0)
    late = np.sqrt(np.diag(estimator.estimate().covariance)[3:6]).max()
    assert late > 1.2 * early
    assert estimator.estimate(SECOND + 5000 * SECOND) is None
    assert "no star tracker for" in estimator.problem or "turn rate is known" in estimator.problem


def test_an_attitude_that_is_not_known_well_enough_is_withheld_though_the_turn_rate_is():
    estimator = make_estimator("attitude", CUBESAT)
    estimator._settings = replace(estimator._settings, attitude_limit_deg=0.005)
    fed(estimator, 10.0)
    assert estimator.estimate() is not None
    fed(estimator, 60.0, tracker=False, begin_s=10.0)
    assert estimator.estimate() is None
    assert estimator.problem == "the attitude is known to 0.01° only: no star tracker for 61 s"


def test_what_the_wheels_take_the_body_loses():
    estimator = make_estimator("attitude", CUBESAT)
    fed(estimator, 5.0)
    speeds = np.zeros(3)
    for k in range(20):
        speeds = speeds + np.array([10.0, 0.0, 0.0])
        estimator.take("wheels", Reading(WheelSpeeds(NAMES, speeds.copy()), 6 * SECOND + k * SECOND // 10))
    lost = speeds[0] * CUBESAT.actuators.spin_inertia / CUBESAT.body.inertia[0]
    found = estimator.estimate().value.angular_velocity_in_body
    assert found[0] == pytest.approx(RATE[0] - lost, rel=0.02)


def test_what_wheels_did_while_they_were_silent_counts_once_the_gyroscope_has_shown_it():
    estimator, spun = make_estimator("attitude", CUBESAT), np.array([0.0, 0.0, 0.02])  # [rad/s]
    now = fed(estimator, 10.0)
    for k in range(1, 31):
        estimator.take("imu", Reading(imu(RATE + spun * k / 30), now + k * SECOND // 10))
    speeds = -CUBESAT.body.inertia_matrix @ spun / CUBESAT.actuators.spin_inertia
    estimator.take("wheels", Reading(WheelSpeeds(NAMES, speeds), now + 3 * SECOND))
    found = estimator.estimate().value.angular_velocity_in_body
    np.testing.assert_allclose(found, RATE + spun, atol=1e-3)


def test_a_late_attitude_counts_at_its_own_time():
    estimator = make_estimator("attitude", CUBESAT)
    now = fed(estimator, 20.0, tracker=True)
    before = off(estimator.estimate(), now)
    late = now - SECOND // 2
    quat = truth((late - SECOND) / 1e9)
    assert estimator.take("star_tracker", Reading(quat, late, covariance=TRACKER_STD**2 * np.eye(3))) is None
    assert off(estimator.estimate(), now) <= before + 1e-6


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("imu", imu([np.nan, 0.0, 0.0]), "not finite"),
        ("imu", imu([50.0, 0.0, 0.0]), "beyond what is possible"),
        ("imu", imu([np.nan, np.nan, np.nan]), "no gyroscope"),
        ("star_tracker", np.array([0.0, 0.0, 0.0, 0.5]), "no unit quaternion"),
        ("star_tracker", np.array([np.nan, 0.0, 0.0, 1.0]), "no unit quaternion"),
        ("wheels", WheelSpeeds(NAMES[:2], np.zeros(2)), "wheel_z are missing"),
        ("wheels", WheelSpeeds(NAMES, np.array([0.0, np.inf, 0.0])), "not finite"),
        ("rate", np.array([0.0, np.nan, 0.0]), "not finite"),
        ("sun", None, "not known here"),
    ],
)
def test_a_reading_that_cannot_be_is_refused_in_words_and_changes_nothing(name, value, said):
    estimator = make_estimator("attitude", CUBESAT)
    now = fed(estimator, 5.0)
    before = estimator.estimate(now + SECOND)
    problem = estimator.take(name, Reading(value, now + SECOND // 2, covariance=np.eye(3)))
    assert said in problem
    after = estimator.estimate(now + SECOND)
    np.testing.assert_allclose(after.value.quat_xyzw, before.value.quat_xyzw, atol=1e-9)


def test_attitudes_from_elsewhere_are_outliers_until_they_agree():
    estimator = make_estimator("attitude", CUBESAT)
    fed(estimator, 10.0)
    jump, problems = Rotation.from_rotvec([0.3, 0.0, 0.0]), []
    for second in range(10, 20):
        elsewhere = (Rotation.from_quat(truth(second)) * jump).as_quat()
        fed(estimator, 1.0, tracker=False, begin_s=second)
        reading = Reading(elsewhere, SECOND + second * SECOND, covariance=TRACKER_STD**2 * np.eye(3))
        problems.append(estimator.take("star_tracker", reading))
    assert all("beyond the gate" in problem for problem in problems[:9])
    assert problems[9] is None
    assert (estimator.outliers, estimator.epoch) == (10, 1)


@pytest.mark.parametrize("order", tuple(itertools.permutations(("star_tracker", "imu", "wheels"))))
@pytest.mark.parametrize("every", [1, 4])
def test_wheels_may_turn_the_body_fast_whatever_the_order_of_readings(order, every):
    """Each tenth of a second, the wheels' each `every` of them."""
    estimator, moment = make_estimator("attitude", CUBESAT), CUBESAT.body.inertia_matrix[2, 2]
    spun = 0.06  # of the body about z [rad/s²]
    for k in range(61):
        t = 0.1 * k
        stamp = SECOND + round(1e9 * t)
        quat = Rotation.from_rotvec([0.0, 0.0, 0.5 * spun * t * t]).as_quat()
        speed = -moment * spun * t / CUBESAT.actuators.spin_inertia
        readings = {
            "imu": Reading(imu([0.0, 0.0, spun * t]), stamp),
            "wheels": Reading(WheelSpeeds(NAMES, np.array([0.0, 0.0, speed])), stamp),
            "star_tracker": Reading(quat, stamp, covariance=TRACKER_STD**2 * np.eye(3)),
        }
        for name in order:
            if k % {"imu": 1, "wheels": every, "star_tracker": 10}[name] == 0:
                assert estimator.take(name, readings[name]) is None
    state = estimator.estimate().value
    assert estimator.outliers == 0
    assert (Rotation.from_quat(state.quat_xyzw) * Rotation.from_quat(quat).inv()).magnitude() < 2e-4
    np.testing.assert_allclose(state.angular_velocity_in_body, [0.0, 0.0, spun * t], atol=2e-4)


def test_a_late_rate_counts_for_its_own_time_while_the_body_turns_faster():
    """As that of events, which comes a quarter of a second after its window while the motors push."""
    estimator, moment, spun = make_estimator("attitude", CUBESAT), CUBESAT.body.inertia_matrix[2, 2], 0.03
    for k in range(101):
        t = 0.1 * k
        stamp = SECOND + round(1e9 * t)
        speed = -moment * spun * t / CUBESAT.actuators.spin_inertia
        wheels = WheelSpeeds(NAMES, np.array([0.0, 0.0, speed]))
        assert estimator.take("wheels", Reading(wheels, stamp)) is None
        if k % 10 == 0:
            quat = Rotation.from_rotvec([0.0, 0.0, 0.5 * spun * t * t]).as_quat()
            reading = Reading(quat, stamp, covariance=TRACKER_STD**2 * np.eye(3))
            assert estimator.take("star_tracker", reading) is None
        if k % 2 == 0 and k > 4:
            seen = Reading(
                np.array([0.0, 0.0, spun * (t - 0.25)]), stamp - SECOND // 4, covariance=4e-10 * np.eye(3)
            )
            assert estimator.take("rate", seen) is None
    found = estimator.estimate().value.angular_velocity_in_body
    np.testing.assert_allclose(found, [0.0, 0.0, spun * t], atol=1e-4)


def test_a_gap_in_all_readings_is_bridged_without_a_past():
    estimator = make_estimator("attitude", CUBESAT)
    now = fed(estimator, 5.0)
    assert estimator.estimate(now + 3 * SECOND) is not None
    assert estimator.take("rate", Reading(RATE, now + SECOND, covariance=1e-10 * np.eye(3))) is None


def test_a_jump_of_time_begins_a_new_epoch():
    estimator = make_estimator("attitude", CUBESAT)
    now = fed(estimator, 5.0)
    assert "jumped" in estimator.take("imu", Reading(imu(RATE), now + 3600 * SECOND))
    assert estimator.epoch == 1
    assert estimator.estimate() is None


def test_estimators_of_satellites_are_refused_for_other_robots_and_the_other_way_round():
    with pytest.raises(
        ConfigError, match=r"'attitude' is for satellites .*'spacecraft_16' is one of .*Use 'mocap_imu_3d'"
    ):
        check_estimator("attitude", load_robot("spacecraft_16"))
    with pytest.raises(
        ConfigError,
        match=r"'mocap_imu_3d' is for bodies that are pushed .*'cubesat_wheels' is one of .*Use 'attitude'",
    ):
        check_estimator("mocap_imu_3d", CUBESAT)
    with pytest.raises(ConfigError, match=r"takes the events of a camera, and 'microsat' has none"):
        check_estimator("event_rate", load_robot("microsat"))
    assert KINDS["inertia"].kinds == (CUBESAT.kind,)


def test_settings_without_meaning_are_refused():
    settings = make_estimator("attitude", CUBESAT)._settings
    with pytest.raises(ValueError, match="'gyroscope_std' = 0 must be greater than 0"):
        replace(settings, gyroscope_std=0.0)
    with pytest.raises(ValueError, match="must not be negative"):
        replace(settings, inertia_share=-1.0)
