"""Inertial units without an accelerometer or without a gyroscope: what there is counts, what is not there is said."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.estimators.kinds import make_estimator
from fulmar_core.estimators.motion.estimator import LACKS_NOTHING
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.imu import KIND, PATHS, ImuSample
from fulmar_core.robots.sensors.wheels import WheelSpeeds
from fulmar_core.wires.reading import Reading

pytest.importorskip("filterpy")
MS = 1_000_000
NONE = np.full(3, np.nan)
TURNING, GRAVITY = np.array([0.0, 0.0, 0.3]), np.array([0.0, 0.0, 9.81])
ROBOTS = {"mocap_imu": ("floating_platform", GRAVITY), "mocap_imu_3d": ("spacecraft_16", np.zeros(3))}


def turned(estimator, sample, *, seconds=2.0):
    """Let an estimator have poses of a body that turns, with one inertial reading at each; returns the last time."""
    stamp = 0
    for k in range(1, round(50 * seconds) + 1):
        stamp, yaw = 1000 * MS + 20 * k * MS, 0.3 * 0.02 * k
        assert estimator.take("imu", Reading(sample, stamp)) is None
        if k % 4 == 0:
            pose = np.array([0.0, 0.0, 0.0, 0.0, 0.0, np.sin(0.5 * yaw), np.cos(0.5 * yaw)])
            pose[:3] += 1e-4 * np.array([k % 3, k % 5, k % 7])
            assert estimator.take("mocap", Reading(pose, stamp)) is None
    return stamp


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("lacks", [LACKS_NOTHING, "accelerometer", "gyroscope"])
def test_an_estimate_of_motion_goes_on_with_what_the_inertial_unit_has(name, lacks):
    robot, rest = ROBOTS[name]
    estimator = make_estimator(name, load_robot(robot), exact_sensors=True)
    sample = ImuSample(NONE if lacks == "accelerometer" else rest, NONE if lacks == "gyroscope" else TURNING)
    estimate = estimator.estimate(turned(estimator, sample))
    assert estimate is not None, estimator.problem
    assert np.isfinite(estimate.covariance).all()
    assert estimate.value.angular_velocity_in_body[2] == pytest.approx(0.3, abs=0.05)
    assert estimator.status()["lacks"] == lacks


@pytest.mark.parametrize("name", ROBOTS)
def test_a_gyroscope_alone_makes_the_turn_rate_better_than_poses_do(name):
    robot, rest = ROBOTS[name]
    spread = {}
    for what, sample in {"gyroscope": ImuSample(NONE, TURNING), "force": ImuSample(rest, NONE)}.items():
        estimator = make_estimator(name, load_robot(robot), exact_sensors=True)
        spread[what] = estimator.estimate(turned(estimator, sample)).covariance[11, 11]
    assert spread["gyroscope"] < 0.2 * spread["force"]


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize(
    ("sample", "said"),
    [
        (ImuSample(NONE, NONE), "neither a specific force nor a turn rate"),
        (ImuSample(np.array([0.0, np.nan, 0.0]), TURNING), "not finite"),
        (ImuSample(NONE, np.array([0.0, np.inf, 0.0])), "not finite"),
    ],
)
def test_a_unit_that_reports_nothing_or_nonsense_is_refused_in_words(name, sample, said):
    estimator = make_estimator(name, load_robot(ROBOTS[name][0]), exact_sensors=True)
    assert said in estimator.take("imu", Reading(sample, 1000 * MS))


def test_the_inertia_needs_the_gyroscope_alone_and_says_so_without_one():
    cubesat = load_robot("cubesat_wheels")
    names = cubesat.actuators.wheel_names
    estimators = {lacking: make_estimator("inertia", cubesat) for lacking in ("accelerometer", "gyroscope")}
    for k in range(5):
        stamp = 1000 * MS + 100 * k * MS
        wheels = Reading(WheelSpeeds(names, np.array([0.0, 0.0, float(k)])), stamp)
        for lacking, estimator in estimators.items():
            rate = NONE if lacking == "gyroscope" else np.array([0.0, 0.0, -1e-3 * k])
            said = estimator.take("imu", Reading(ImuSample(NONE, rate), stamp))
            assert said is None or "no gyroscope" in said
            assert estimator.take("wheels", wheels) is None
            estimator.estimate()
    assert "cannot be observed" in estimators["accelerometer"].problem  # it has begun
    assert "no gyroscope" in estimators["gyroscope"].problem


@pytest.mark.parametrize("vector", ["linear_acceleration", "angular_velocity"])
def test_what_rep_145_marks_as_absent_is_not_measured_and_is_written_so_again(vector):
    values = dict.fromkeys(PATHS, 0.5) | dict.fromkeys(
        (path for path in PATHS if path.endswith("covariance")), np.zeros(9)
    )
    values[f"{vector}_covariance"] = np.array([-1.0, *np.zeros(8)])
    reading = KIND.message.read([values[path] for path in PATHS])
    forceless = vector == "linear_acceleration"
    assert reading.value.has_force is not forceless
    assert reading.value.has_rate is forceless
    written = dict(zip(PATHS, KIND.message.write(reading, load_robot("turtlebot2").sensors.imu), strict=True))
    assert written[f"{vector}_covariance"][0] == -1.0
    assert written[f"{vector}.x"] == 0.0
