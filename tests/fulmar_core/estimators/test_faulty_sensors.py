"""Sensors of a satellite that freeze, drift or jump: named in words, and never believed for long."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fulmar_core.estimators.kinds import make_estimator
from fulmar_core.estimators.motion.satellite_repeats import EVENTS, GYROSCOPE, STAR_TRACKER, WHEEL
from fulmar_core.estimators.motion.tracker_trust import DRIFTS, DRIFTS_ALONE, JUMPS, SCATTERS, WALKS
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.imu import ImuSample
from fulmar_core.robots.sensors.wheels import WheelSpeeds
from fulmar_core.wires.reading import Reading
from tests.satellite_loop import fly

CUBESAT = load_robot("cubesat_wheels")
NAMES = CUBESAT.actuators.wheel_names
SECOND = 1_000_000_000
RATE = np.array([0.0, 0.0, 0.002])  # about a principal axis, so that it stays without a torque [rad/s]
STD = 1e-4  # of attitudes whose message states no covariance, see configs/estimators/attitude.yaml [rad]
DRIFT = np.radians([0.05, 0.0, 0.0])  # [rad/s]


class Body:
    """A body that turns steadily, and an estimator that its sensors report to; faults begin when they are set."""

    def __init__(self, *, events: bool = False) -> None:
        self.estimator = make_estimator("attitude", CUBESAT)
        self.rng = np.random.default_rng(4)
        self.ticks, self.events = 0, events
        self.frozen: dict[str, Reading] = {}  # by name, what is repeated
        self.tracker_turns = np.zeros(3)  # rate of a wrong turn of the star tracker [rad/s]
        self.tracker_off = np.zeros(3)  # about the axes of the body [rad]
        self.catalogue_off = np.zeros(3)  # about those of the world [rad]
        self.scatter = 0.0  # [rad]
        self.gyro_bias = np.zeros(3)  # [rad/s]
        self.newest: dict[str, Reading] = {}

    @property
    def time_s(self) -> float:
        return 0.1 * self.ticks

    @property
    def now_ns(self) -> int:
        return SECOND + self.ticks * SECOND // 10

    def noise(self, std: float) -> np.ndarray:
        return std * self.rng.standard_normal(3)

    def truth(self) -> Rotation:
        return Rotation.from_rotvec(RATE * self.time_s)

    def tick(self) -> None:
        self.ticks += 1
        readings = {
            "imu": ImuSample(np.zeros(3), RATE + self.gyro_bias + self.noise(1e-6)),
            "wheels": WheelSpeeds(NAMES, np.array([50.0, 60.0, 70.0]) + self.noise(0.01)),
        }
        if self.ticks % 10 == 0:
            self.tracker_off = self.tracker_off + self.tracker_turns
            wrong = Rotation.from_rotvec(self.tracker_off + self.noise(self.scatter) + self.noise(STD))
            seen = Rotation.from_rotvec(self.catalogue_off) * self.truth() * wrong
            readings["star_tracker"] = seen.as_quat()
        if self.events and self.ticks % 2 == 0:
            readings["rate"] = RATE + self.noise(2e-5)
        for name, value in sorted(readings.items()):
            covariance = 4e-10 * np.eye(3) if name == "rate" else None
            reading = Reading(value, self.now_ns, covariance=covariance)
            if name in self.frozen:
                reading = replace(self.frozen[name], stamp_ns=self.now_ns)
            self.newest[name] = reading
            self.estimator.take(name, reading)

    def run(self, seconds: float) -> Body:
        for _ in range(round(10 * seconds)):
            self.tick()
        return self

    def freeze(self, name: str) -> None:
        self.frozen[name] = self.newest[name]

    def until(self, words: str, most_s: float) -> float:
        """Seconds until a warning says so."""
        for k in range(round(10 * most_s)):
            if words in self.estimator.warnings():
                return 0.1 * k
            self.tick()
        raise AssertionError(f"not within {most_s} s: {self.estimator.warnings()}")

    def off_deg(self) -> float:
        estimate = self.estimator.estimate(self.now_ns)
        assert estimate is not None, self.estimator.problem
        return float(
            np.degrees((self.truth().inv() * Rotation.from_quat(estimate.value.quat_xyzw)).magnitude())
        )


@pytest.fixture
def body() -> Body:
    return Body().run(20.0)


def test_sound_sensors_are_believed_without_a_word(body):
    assert body.estimator.warnings() == ()
    assert body.off_deg() < 0.01
    assert body.estimator.outliers == 0


def test_a_frozen_star_tracker_is_named_after_three_repeats_and_not_used(body):
    body.freeze("star_tracker")
    assert body.until(STAR_TRACKER, 5.0) <= 4.0
    assert body.run(20.0).off_deg() < 0.02  # what it has turned since then: 2.7°
    del body.frozen["star_tracker"]
    body.run(3.0)
    assert body.estimator.warnings() == ()


def test_a_star_tracker_that_is_frozen_from_the_start_is_not_believed():
    body = Body().run(1.0)
    body.freeze("star_tracker")
    body.until(STAR_TRACKER, 5.0)
    assert body.estimator.estimate(body.now_ns) is None
    assert "no other attitude was ever seen" in body.estimator.problem


@pytest.mark.parametrize(("name", "words"), [("imu", GYROSCOPE), ("rate", EVENTS)])
def test_a_frozen_source_of_the_turn_rate_is_named_and_replaced(name, words):
    body = Body(events=True).run(20.0)
    body.freeze(name)
    body.until(words, 2.5)
    body.run(10.0)
    assert body.estimator.rate_source == ("events" if name == "imu" else "gyroscope")
    assert body.off_deg() < 0.02


def test_a_tachometer_that_is_frozen_is_named_and_what_its_wheel_does_is_not_missed(body):
    speeds = body.newest["wheels"].value.speeds.copy()
    spun = np.zeros(3)
    for k in range(1, 31):  # wheel_x turns the body, its tachometer does not say so
        body.ticks += 1
        speeds[1:] += 0.01 * body.rng.standard_normal(2)
        spun = np.array([3e-3 * k, 0.0, 0.0])
        body.estimator.take("wheels", Reading(WheelSpeeds(NAMES, speeds.copy()), body.now_ns))
        body.estimator.take("imu", Reading(ImuSample(np.zeros(3), RATE + spun), body.now_ns))
    assert body.estimator.warnings() == (WHEEL.format(wheel="wheel_x"),)
    found = body.estimator.estimate(body.now_ns).value.angular_velocity_in_body
    np.testing.assert_allclose(found, RATE + spun, atol=3e-5)


def test_wheels_that_stand_are_no_frozen_tachometers(body):
    for _ in range(50):
        body.ticks += 1
        reading = Reading(WheelSpeeds(NAMES, np.zeros(3)), body.now_ns)
        assert not (body.estimator.take("wheels", reading) or "")
    assert body.estimator.warnings() == ()


@pytest.mark.parametrize("sensor", ["star tracker", "gyroscope"])
def test_a_drift_of_star_tracker_or_gyroscope_stops_in_words_before_it_turns_the_attitude(body, sensor):
    if sensor == "star tracker":
        body.tracker_turns = DRIFT
    else:
        body.gyro_bias = DRIFT
    # The drift passes the gate of 4 standard deviations with the first reading; three are needed.
    assert body.until(DRIFTS.format(rate="gyroscope"), 6.0) <= 4.0
    assert body.estimator.estimate(body.now_ns) is None
    assert "drift apart" in body.estimator.problem


def test_a_star_tracker_that_drifts_is_left_out_where_event_cameras_bear_out_the_gyroscope():
    body = Body(events=True).run(20.0)
    body.tracker_turns = DRIFT
    assert body.until(DRIFTS_ALONE, 6.0) <= 4.0
    assert body.run(20.0).off_deg() < 0.02  # the star tracker is 1° off


def test_readings_that_match_again_end_a_doubt():
    body = Body().run(20.0)
    body.tracker_turns = DRIFT
    body.until(DRIFTS.format(rate="gyroscope"), 6.0)
    body.tracker_turns = body.tracker_off = np.zeros(3)
    body.run(12.0)
    assert body.estimator.warnings() == ()
    assert body.off_deg() < 0.02


def test_a_drifted_star_tracker_that_stands_still_again_is_not_followed(body):
    body.tracker_turns = DRIFT
    body.until(DRIFTS.format(rate="gyroscope"), 6.0)
    body.tracker_turns = np.zeros(3)
    body.run(30.0)
    assert body.estimator.epoch == 0
    assert body.estimator.estimate(body.now_ns) is None


def test_a_drift_too_slow_for_the_gate_makes_a_bias_that_no_data_sheet_explains():
    body = Body().run(60.0)
    body.tracker_turns = np.radians([0.001, 0.0, 0.0])
    assert body.until(WALKS, 120.0) < 100.0
    body.tracker_turns = np.zeros(3)
    body.run(20.0)
    assert WALKS in body.estimator.warnings()  # until the estimator begins anew


def test_a_star_tracker_that_jumps_once_is_followed_and_one_that_jumps_again_is_not(body):
    body.catalogue_off = np.array([0.3, 0.0, 0.0])
    body.run(12.0)
    assert (body.estimator.epoch, body.estimator.warnings()) == (1, ())
    body.run(20.0)
    body.catalogue_off = np.array([0.0, 0.3, 0.0])
    body.until(JUMPS, 15.0)
    assert body.estimator.estimate(body.now_ns) is None


def test_attitudes_that_fit_nothing_are_not_followed(body):
    body.scatter = 0.5
    body.until(SCATTERS.format(rate="gyroscope"), 25.0)
    assert body.estimator.epoch == 0


def test_the_turn_rate_alone_may_be_too_uncertain():
    """As where gyroscope, wheels and stars fall silent at once: the attitude is known for longer than the rate."""
    estimator = Body().run(10.0).estimator
    now_ns = SECOND + 10 * SECOND
    assert estimator.estimate(now_ns + 2 * SECOND) is not None
    late = estimator.estimate(now_ns + round(4.2 * SECOND))
    assert late is None
    assert estimator.problem.startswith("the turn rate is known to 1.")


def test_the_inertia_is_withheld_while_a_sensor_repeats_itself():
    estimator, rng = make_estimator("inertia", CUBESAT), np.random.default_rng(0)
    rate = ImuSample(np.zeros(3), RATE)
    for k in range(20):
        stamp = SECOND + k * SECOND // 10
        estimator.take("imu", Reading(rate, stamp))
        speeds = np.full(3, 3.0 * k) + rng.standard_normal(3)
        estimator.take("wheels", Reading(WheelSpeeds(NAMES, speeds), stamp))
    assert estimator.warnings() == (GYROSCOPE,)
    assert estimator.estimate() is None
    assert estimator.problem == GYROSCOPE


def frozen(which: str, at_s: float):
    kept: dict[str, Reading] = {}

    def spoil(name, reading, time_s):
        if name == which and time_s >= at_s:
            return replace(kept[name], stamp_ns=reading.stamp_ns)
        kept[name] = reading
        return reading

    return spoil


def drifting(deg_s: float, at_s: float):
    def spoil(name, reading, time_s):
        if name != "star_tracker" or time_s < at_s:
            return reading
        wrong = Rotation.from_rotvec([0.0, 0.0, np.radians(deg_s) * (time_s - at_s)])
        value = (Rotation.from_quat(reading.value) * wrong).as_quat()
        return replace(reading, value=value, covariance=None)

    return spoil


SATELLITES = ("cubesat_wheels", "microsat", "smallsat")


@pytest.mark.slow
@pytest.mark.parametrize("name", SATELLITES)
@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("task", ["slew", "point_inertial"])
def test_no_satellite_follows_a_frozen_or_a_drifting_star_tracker(name, seed, task):
    how = {"task": task, "seed": seed, "seconds": 40.0, "angle_deg": 40.0 if task == "slew" else None}
    for spoil, words, most_s in (
        (frozen("star_tracker", 20.0), STAR_TRACKER, 4.0),
        (drifting(0.05, 20.0), DRIFTS.format(rate="gyroscope"), 4.0),
    ):
        flight = fly(name, spoil=spoil, **how)
        assert flight.first(words) - 20.0 <= most_s
        assert np.nanmax(flight.errors_deg[40:]) < 0.05
        assert flight.epochs == 0


@pytest.mark.slow
@pytest.mark.parametrize("name", SATELLITES)
@pytest.mark.parametrize("which", ["imu", "wheels"])
def test_no_satellite_is_misled_by_a_frozen_gyroscope_or_frozen_wheels(name, which):
    flight = fly(name, spoil=frozen(which, 20.0), task="slew", seconds=60.0, angle_deg=40.0)
    assert flight.first("repeats itself") - 20.0 <= 1.1
    assert np.nanmax(flight.errors_deg[40:]) < 0.05
    assert flight.pointing_deg[-1] < 1.0
    assert flight.stopped_s == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("name", SATELLITES)
def test_no_sound_satellite_is_stopped_by_a_false_alarm(name):
    for how in ({"task": "point_inertial"}, {"task": "slew", "goals_s": 60.0}, {"law": "excite"}):
        flight = fly(name, seconds=240.0, **how)
        assert (flight.stopped_s, flight.epochs) == (0.0, 0)
        assert not any("repeats" in words or "drift" in words or "walks" in words for words in flight.said)
