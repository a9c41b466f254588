"""Sources of an estimator of motion that only repeat their last value."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.robots.robot import Sensors
from fulmar_core.robots.sensors.imu import ImuSample
from fulmar_core.robots.sensors.repetition import FROZEN_AFTER, RepetitionCheck, is_noisy

POSE_FROZEN = "motion capture repeats its pose: it is frozen"
INERTIAL_FROZEN = "the {} repeats its reading: it is frozen"
SLOWEST = 3.0  # periods of a source that is published faster than it measures, for which a value may stand


@dataclass(frozen=True)
class Noise:
    """Which sources have noise, so that they never repeat a value, and how long they hold one."""

    pose: bool = False
    accelerometer: bool = False
    gyroscope: bool = False
    pose_held_s: float = 0.0  # [s]
    inertial_held_s: float = 0.0  # [s]


EXACT = Noise()


def noise_of(sensors: Sensors) -> Noise:
    """As a robot's file says; simulated motion capture sees what its odometry measures."""
    odometry, imu = sensors.odometry, sensors.imu
    return Noise(
        is_noisy(odometry.position, odometry.heading),
        is_noisy(imu.accelerometer),
        is_noisy(imu.gyroscope),
        SLOWEST / odometry.rate_hz if odometry.rate_hz else 0.0,
        SLOWEST / imu.rate_hz if imu.rate_hz else 0.0,
    )


class FrozenSources:
    """Motion capture, accelerometer and gyroscope of one robot, each by itself.

    Attributes:
        pose_words: That motion capture is frozen; empty if it is not.
    """

    def __init__(self, noise: Noise, *, bridge_s: float) -> None:
        """Begin without readings; poses that repeat for `bridge_s` [s] count as frozen, however slow they come."""

        def check(noisy: bool, held_s: float, after_s: float) -> RepetitionCheck:
            return RepetitionCheck(after=FROZEN_AFTER if noisy else 0, after_s=after_s, held_s=held_s)

        self._pose = check(noise.pose, noise.pose_held_s, bridge_s)
        self._inertial = {
            "accelerometer": check(noise.accelerometer, noise.inertial_held_s, bridge_s),
            "gyroscope": check(noise.gyroscope, noise.inertial_held_s, bridge_s),
        }
        self.forget()

    def forget(self) -> None:
        """Begin anew."""
        self.pose_words, self._inertial_words = "", ""
        for check in (self._pose, *self._inertial.values()):
            check.forget()

    def words(self) -> tuple[str, ...]:
        """What is frozen now; an empty text where nothing is."""
        return self.pose_words, self._inertial_words

    def pose_problem(self, pose: np.ndarray, stamp_ns: int) -> str:
        """Why a pose is no measurement: one that equals the last was not measured anew. Empty if it is one."""
        frozen = self._pose.see(pose, stamp_ns)
        self.pose_words = POSE_FROZEN if frozen else ""
        if frozen or not self._pose.repeats:
            return self.pose_words
        return "the pose repeats the last one to the last bit: it was not measured anew"

    def inertial_problem(self, sample: ImuSample, stamp_ns: int) -> str:
        """Why an inertial reading is none; empty if it is one, or is held as by a unit that is read too often."""
        parts = {"accelerometer": sample.specific_force, "gyroscope": sample.angular_velocity}
        frozen = [name for name, check in self._inertial.items() if check.see(parts[name], stamp_ns)]
        self._inertial_words = INERTIAL_FROZEN.format(" and the ".join(frozen)) if frozen else ""
        if len(frozen) > 1:
            self._inertial_words = "the inertial unit repeats its readings: it is frozen"
        return self._inertial_words
