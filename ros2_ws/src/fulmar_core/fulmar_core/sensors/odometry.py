"""Pose and velocity as a motion-capture or odometry source reports them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.rotation import from_rotation_vector, multiply
from fulmar_core.state import RigidBodyState

Vector3 = tuple[float, float, float]


@dataclass(frozen=True)
class OdometrySpec:
    """White noise of the odometry, which comes at every plant tick; standard deviations by axis, >= 0."""

    position_std: Vector3  # world axes [m]
    rotation_std: Vector3  # body axes [rad]
    velocity_std: Vector3  # world axes [m/s]
    angular_velocity_std: Vector3  # body axes [rad/s]

    def __post_init__(self) -> None:
        """Refuse noises without meaning."""
        stds = (*self.position_std, *self.rotation_std, *self.velocity_std, *self.angular_velocity_std)
        if min(stds) < 0.0:
            raise ValueError("standard deviations must not be negative.")


def measure_odometry(truth: RigidBodyState, spec: OdometrySpec, rng: np.random.Generator) -> RigidBodyState:
    """What the odometry reports of a true state.

    Args:
        truth: True state, NumPy arrays with any leading shape.
        spec: Noise.
        rng: Source of the noise; twelve normal numbers are drawn for every body.

    Returns:
        Measured state of the same shape and floating type.
    """
    dtype = truth.position_in_world.dtype
    noise = rng.standard_normal((*truth.position_in_world.shape[:-1], 12), dtype=np.float32).astype(
        dtype, copy=False
    )
    scale = np.asarray(
        (*spec.position_std, *spec.rotation_std, *spec.velocity_std, *spec.angular_velocity_std), dtype=dtype
    )
    noise = noise * scale
    return RigidBodyState(
        truth.position_in_world + noise[..., 0:3],
        multiply(truth.quat_xyzw, from_rotation_vector(noise[..., 3:6])),
        truth.velocity_in_world + noise[..., 6:9],
        truth.angular_velocity_in_body + noise[..., 9:12],
    )
