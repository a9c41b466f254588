"""Specific force and turn rate as an inertial unit reports them (REP-145: +g at rest)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class ImuSpec:
    """White noise of an inertial unit; standard deviations, >= 0."""

    accelerometer_std: float  # [m/s²]
    gyroscope_std: float  # [rad/s]

    def __post_init__(self) -> None:
        """Refuse noises without meaning."""
        if min(self.accelerometer_std, self.gyroscope_std) < 0.0:
            raise ValueError("standard deviations must not be negative.")


@dataclass(frozen=True, slots=True)
class ImuSample:
    """One reading, in the frame of the unit."""

    specific_force: np.ndarray  # (3,) acceleration minus gravity [m/s²]
    angular_velocity: np.ndarray  # (3,) [rad/s]


def measure_imu(truth: ImuSample, spec: ImuSpec, rng: np.random.Generator) -> ImuSample:
    """What the unit reports of true motion.

    Args:
        truth: Noise-free reading.
        spec: Noise.
        rng: Source of the noise; six normal numbers are drawn.

    Returns:
        Measured reading.
    """
    noise = rng.standard_normal(6)
    return ImuSample(
        truth.specific_force + spec.accelerometer_std * noise[:3],
        truth.angular_velocity + spec.gyroscope_std * noise[3:],
    )
