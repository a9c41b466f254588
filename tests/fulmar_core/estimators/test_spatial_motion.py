"""Poses, inertial readings and star tracker attitudes of a tumbling body to one estimate, with honest covariances."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.estimators.kinds import make_estimator
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.imu import ImuSample
from fulmar_core.states.attitude import exponential, product, rotation_error
from fulmar_core.states.gravity import GRAVITY
from fulmar_core.states.rotation import rotate, rotate_inverse
from fulmar_core.states.state import RigidBodyState
from fulmar_core.wires.reading import Reading

pytest.importorskip("filterpy")
ROBOT = load_robot("spacecraft_16")
DT = 0.005
BEGIN_NS = 1_000_000_000
PLACE_STD, TURN_STD, GYRO_STD, FORCE_STD = 0.001, 0.002, 0.0012, 0.0086


@pytest.mark.parametrize("speed", [0.0, 28.0])
def test_a_craft_in_the_air_is_followed_from_its_first_pose_on(speed):
    # It begins in flight, and its accelerometer feels what carries it.
    estimator = make_estimator("mocap_imu_3d", load_robot("airship_v7"), exact_sensors=True)
    feels = ImuSample(np.array([0.0, 0.0, GRAVITY]), np.zeros(3))
    for number in range(200):
        stamp_ns, place = BEGIN_NS + round(1e9 * DT * number), np.array([speed * DT * number, 0.0, 30.0])
        assert estimator.take("imu", Reading(feels, stamp_ns)) is None
        if number % 8 == 0 and number < 180:  # from there on by inertial readings alone
            level = np.array([*place, 0.0, 0.0, 0.0, 1.0])
            assert estimator.take("mocap", Reading(level, stamp_ns)) is None
    found = estimator.estimate(stamp_ns)
    assert found is not None, estimator.problem
    np.testing.assert_allclose(found.value.velocity_in_world, (speed, 0.0, 0.0), atol=1e-3)
    np.testing.assert_allclose(found.value.position_in_world, place, atol=1e-3)


class Tumble:
    """A body that turns about a moving axis and is pushed about, measured with noise and biases."""

    def __init__(self, seed: int, *, gyro_bias: float = 0.0) -> None:
        self.rng = np.random.default_rng(seed)
        self.position, self.velocity = np.zeros(3), self.rng.normal(0.0, 0.1, 3)
        quat = self.rng.normal(size=4)
        self.quat = quat / np.linalg.norm(quat)
        self.phase = self.rng.uniform(0.0, 6.0, 3)
        self.gyro_bias = gyro_bias * np.array([1.0, -1.0, 0.5])
        self.time = 0.0
        self.estimator = make_estimator("mocap_imu_3d", ROBOT)

    @property
    def rate(self) -> np.ndarray:
        return 0.4 * np.sin(0.7 * self.time + self.phase)

    @property
    def push(self) -> np.ndarray:
        """Acceleration in the world [m/s²]."""
        return 0.15 * np.sin(1.1 * self.time + 2.0 * self.phase)

    def noise(self, std: float) -> np.ndarray:
        return std * self.rng.standard_normal(3)

    def step(self) -> None:
        middle = self.push
        self.position = self.position + DT * self.velocity + 0.5 * DT * DT * middle
        self.velocity = self.velocity + DT * middle
        self.time += 0.5 * DT
        self.quat = np.asarray(product(tuple(self.quat), exponential(tuple(DT * self.rate))))
        self.quat /= np.linalg.norm(self.quat)
        self.time += 0.5 * DT

    @property
    def stamp_ns(self) -> int:
        return BEGIN_NS + round(1e9 * self.time)

    def measure(self, *, pose: bool, stars: bool = False, inertial: bool = True) -> None:
        force = rotate_inverse(self.quat, self.push) + self.noise(FORCE_STD)
        sample = ImuSample(force, self.rate + self.gyro_bias + self.noise(GYRO_STD))
        if inertial:
            assert self.estimator.take("imu", Reading(sample, self.stamp_ns)) is None
        if pose:
            seen = np.asarray(product(tuple(self.quat), exponential(tuple(self.noise(TURN_STD)))))
            value = np.concatenate((self.position + self.noise(PLACE_STD), seen))
            assert self.estimator.take("mocap", Reading(value, self.stamp_ns)) is None
        if stars:
            seen = np.asarray(product(tuple(self.quat), exponential(tuple(self.noise(0.0005)))))
            reading = Reading(seen, self.stamp_ns, 0.0005**2 * np.eye(3))
            assert self.estimator.take("star_tracker", reading) is None

    def run(self, seconds: float, *, every: int = 8, stars_every: int = 0, inertial: bool = True) -> None:
        for number in range(round(seconds / DT)):
            self.step()
            stars = bool(stars_every) and number % stars_every == 0
            self.measure(pose=number % every == 0, stars=stars, inertial=inertial)

    def errors(self) -> tuple[np.ndarray, np.ndarray]:
        """Error of the estimate (12,), and its covariance."""
        estimate = self.estimator.estimate(self.stamp_ns)
        assert estimate is not None, self.estimator.problem
        state: RigidBodyState = estimate.value
        turn = rotate(self.quat, np.asarray(rotation_error(tuple(state.quat_xyzw), tuple(self.quat))))
        error = np.concatenate(
            (
                self.position - state.position_in_world,
                turn,
                self.velocity - state.velocity_in_world,
                self.rate - state.angular_velocity_in_body,
            )
        )
        return error, estimate.covariance


def test_a_tumbling_body_is_followed_in_all_thirteen_numbers():
    errors = []
    for seed in range(4):
        track = Tumble(seed)
        track.run(6.0)
        errors.append(track.errors()[0])
    spread = np.sqrt(np.mean(np.square(errors), axis=0))
    assert spread[:3].max() < 0.001  # better than a single pose [m]
    assert spread[3:6].max() < 0.002  # [rad]
    assert spread[6:9].max() < 0.01  # [m/s]
    assert spread[9:].max() < 2.0 * GYRO_STD  # [rad/s]


@pytest.mark.slow
def test_without_an_inertial_unit_the_turn_rate_follows_from_poses():
    errors, ratios = [], []
    for seed in range(20):
        track = Tumble(seed)
        track.run(6.0, inertial=False)
        error, covariance = track.errors()
        errors.append(error)
        ratios.append(error[9:] @ np.linalg.solve(covariance[9:, 9:], error[9:]))
    spread = np.sqrt(np.mean(np.square(errors), axis=0))
    assert spread[:3].max() < 0.003  # [m]
    assert spread[3:6].max() < 0.005  # [rad]
    assert spread[9:].max() < 0.08  # of rates up to 0.4 [rad/s]
    assert np.mean(ratios) < 3.0 + 3.0 * np.sqrt(2.0 * 3.0 / 20.0)


def test_a_gyroscope_that_falls_silent_leaves_its_bias_and_no_phantom_rate():
    track = Tumble(3, gyro_bias=0.02)
    track.run(8.0)
    track.run(3.0, inertial=False)
    assert np.abs(track.errors()[0][9:]).max() < 0.1
    track.run(1.0)
    assert np.abs(track.errors()[0][9:]).max() < 0.02


@pytest.mark.slow
def test_the_covariance_is_honest_or_careful():
    ratios = []
    for seed in range(20):
        track = Tumble(100 + seed)
        track.run(4.0)
        error, covariance = track.errors()
        ratios.append(error[:9] @ np.linalg.solve(covariance[:9, :9], error[:9]))
    # Mean of 20 draws of chi-squared with 9 degrees of freedom has a deviation of 0.95; settings are careful.
    assert 2.0 < np.mean(ratios) < 9.0 + 3.0 * 0.95


def test_a_bias_of_the_gyroscope_is_found():
    track = Tumble(3, gyro_bias=0.01)
    track.run(20.0)
    assert np.abs(track.errors()[0][9:]).max() < 0.004


def test_a_star_tracker_makes_the_attitude_better():
    alone, helped = [], []
    for seed in range(3):
        for stars, kept in ((0, alone), (20, helped)):
            track = Tumble(40 + seed)
            track.run(4.0, every=20, stars_every=stars)
            kept.append(track.errors()[0][3:6])
    assert np.sqrt(np.mean(np.square(helped))) < 0.7 * np.sqrt(np.mean(np.square(alone)))


def estimated(track):
    """The newest estimate's 13 numbers and its covariance, in one row."""
    estimate = track.estimator.estimate()
    assert estimate is not None, track.estimator.problem
    state = estimate.value
    return np.concatenate(
        (
            state.position_in_world,
            state.quat_xyzw,
            state.velocity_in_world,
            state.angular_velocity_in_body,
            estimate.covariance.ravel(),
        )
    )


def test_a_pose_that_comes_late_is_taken_in_at_its_own_time():
    found = {}
    for arrival in ("in order", "late", "never"):
        track = Tumble(7)
        track.run(3.0)
        value, stamp = np.concatenate((track.position, track.quat)), track.stamp_ns
        if arrival == "in order":
            assert track.estimator.take("mocap", Reading(value, stamp)) is None
        for _ in range(20):
            track.step()
            track.measure(pose=False)
        if arrival == "late":
            assert track.estimator.take("mocap", Reading(value, stamp)) is None
        found[arrival] = estimated(track)
    np.testing.assert_allclose(found["late"], found["in order"], rtol=0.0, atol=1e-9)
    assert np.abs(found["never"] - found["in order"]).max() > 1e-5


def test_a_late_pose_beyond_the_gate_is_rejected():
    track = Tumble(7)
    track.run(3.0)
    value, stamp = np.concatenate((track.position, track.quat)), track.stamp_ns
    for _ in range(20):
        track.step()
        track.measure(pose=False)
    wrong = value + np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert "beyond the gate" in track.estimator.take("mocap", Reading(wrong, stamp))


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("mocap", np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.1]), "has norm 1.100, must be 1"),
        ("star_tracker", np.array([0.0, np.nan, 0.0, 1.0]), "not finite"),
        (
            "imu",
            ImuSample(np.zeros(3), np.array([9.0, 9.0, 0.0])),
            "turn rate 12.7 rad/s is beyond the possible",
        ),
    ],
)
def test_a_reading_that_cannot_be_is_refused_with_one_line(name, value, words):
    track = Tumble(1)
    track.run(0.1)
    assert words in track.estimator.take(name, Reading(value, track.stamp_ns + 1))


def test_a_saturated_gyroscope_is_no_measurement_and_there_is_no_estimate_until_it_reads_again() -> None:
    body = Tumble(4)
    body.run(2.0)
    assert body.estimator.estimate() is not None
    body.step()
    full = ROBOT.sensors.imu.gyroscope_range
    reading = Reading(ImuSample(np.zeros(3), np.array([0.1, -full, 0.0])), body.stamp_ns)
    problem = body.estimator.take("imu", reading)
    assert problem == (
        "the gyroscope reads 8.73 rad/s, the end of its range: the body tumbles too fast for it"
    )
    assert body.estimator.estimate() is None
    assert body.estimator.problem == problem
    body.run(0.1)
    assert body.estimator.estimate() is not None
    assert body.estimator.problem == ""


@pytest.mark.parametrize(
    ("value", "late_ns", "words"),
    [
        (ImuSample(np.zeros(3), np.zeros(3)), 0, "did not advance"),
        (ImuSample(np.zeros(3), np.zeros(3)), -2_000_000, "did not advance"),
        (ImuSample(np.zeros(3), np.array([np.nan, 0.0, 0.0])), 1, "not finite"),
        (ImuSample(np.zeros(3), np.array([8.0, 8.0, 8.0])), 1, "is beyond the possible"),
    ],
)
def test_only_a_valid_newer_reading_ends_the_saturation(value, late_ns, words) -> None:
    body = Tumble(4)
    body.run(2.0)
    body.step()
    full = ROBOT.sensors.imu.gyroscope_range
    saturated = Reading(ImuSample(np.zeros(3), np.array([0.1, -full, 0.0])), body.stamp_ns)
    problem = body.estimator.take("imu", saturated)
    assert words in body.estimator.take("imu", Reading(value, body.stamp_ns + late_ns))
    assert body.estimator.estimate() is None
    assert body.estimator.problem == problem
    body.run(0.1)
    assert body.estimator.estimate() is not None


@pytest.mark.parametrize(
    ("value", "late_ns"),
    [
        (ImuSample(np.zeros(3), np.array([0.0, 9.0, 0.0])), 0),
        (ImuSample(np.array([np.nan, 0.0, 0.0]), np.array([0.0, 9.0, 0.0])), 1),
    ],
)
def test_a_saturated_reading_that_is_stale_or_not_finite_withholds_no_estimate(value, late_ns) -> None:
    body = Tumble(4)
    body.run(2.0)
    assert body.estimator.take("imu", Reading(value, body.stamp_ns + late_ns))
    assert body.estimator.estimate() is not None


def test_an_impossible_turn_rate_at_the_end_of_the_range_is_a_saturation() -> None:
    body = Tumble(4)
    body.run(2.0)
    body.step()
    problem = body.estimator.take("imu", Reading(ImuSample(np.zeros(3), np.full(3, 9.0)), body.stamp_ns))
    assert "is beyond the possible" in problem
    assert body.estimator.estimate() is None
    assert "the end of its range" in body.estimator.problem
