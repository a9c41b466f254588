"""Measured motion of a body's centre of mass along and about the world's axes."""

from __future__ import annotations

import math

import numpy as np

from fulmar_core.states.state import RigidBodyState


class BodyMotion:
    """One measurement.

    Attributes:
        rotation: From the body's frame to the world's, shape (3, 3).
        position: Of the centre of mass in the world, shape (3,) [m].
        velocity: Same, of six numbers: its velocity [m/s], and the turn rate about the world's axes [rad/s].
    """

    def __init__(self, state: RigidBodyState, com: np.ndarray) -> None:
        """Take the motion of the body's origin, and where the centre of mass is from it, shape (3,) [m]."""
        self.rotation = matrix_of(np.asarray(state.quat_xyzw, dtype=float))
        arm = self.rotation @ com
        rate = self.rotation @ np.asarray(state.angular_velocity_in_body, dtype=float)
        self.position = np.asarray(state.position_in_world, dtype=float) + arm
        velocity = np.asarray(state.velocity_in_world, dtype=float) + crossed(rate, arm)
        self.velocity = np.concatenate((velocity, rate))


def crossed(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross product of two vectors, shape (3,), faster than NumPy's."""
    x, y, z = a.tolist()
    u, v, w = b.tolist()
    return np.array([y * w - z * v, z * u - x * w, x * v - y * u])


def matrix_of(quat: np.ndarray) -> np.ndarray:
    """Rotation matrix of a quaternion (x, y, z, w), shape (3, 3)."""
    x, y, z, w = (quat / math.sqrt(float(quat @ quat))).tolist()
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def matrix_about(vector: np.ndarray) -> np.ndarray:
    """Rotation matrix of a rotation vector [rad], shape (3, 3)."""
    angle = math.sqrt(float(vector @ vector))
    share = math.sin(0.5 * angle) / angle if angle > 1e-9 else 0.5
    return matrix_of(np.array([*(share * vector), math.cos(0.5 * angle)]))


def rotation_vector(matrix: np.ndarray) -> np.ndarray:
    """Rotation vector of a rotation by less than half a turn, shape (3,) [rad]."""
    m = matrix.tolist()
    twice = np.array([m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]])
    sine, cosine = 0.5 * math.sqrt(float(twice @ twice)), 0.5 * (m[0][0] + m[1][1] + m[2][2] - 1.0)
    return 0.5 * twice * (math.atan2(sine, cosine) / sine if sine > 1e-9 else 1.0)
