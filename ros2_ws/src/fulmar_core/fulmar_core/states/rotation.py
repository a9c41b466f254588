"""Rotations as unit quaternions in ROS order (x, y, z, w), batch-first, any array library.

Formulas: Solà, "Quaternion kinematics for the error-state Kalman filter", arXiv 1711.02508 (his order is w first).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from fulmar_core.states.arrays import array_namespace, side_by_side

Array = Any  # an array of NumPy, torch or any other library that follows the array API


def rotate(quat_xyzw: Array, vector: Array) -> Array:
    """Express body-frame vectors in the world frame.

    Args:
        quat_xyzw: Attitude of the body in the world, shape (..., 4).
        vector: Vectors in the body frame, shape (..., 3).

    Returns:
        The same vectors in the world frame, shape (..., 3).
    """
    return _turn(quat_xyzw, vector, quat_xyzw[..., 3])


def rotate_inverse(quat_xyzw: Array, vector: Array) -> Array:
    """Express world-frame vectors in the body frame; shapes as in `rotate`."""
    return _turn(quat_xyzw, vector, -quat_xyzw[..., 3])


def _turn(quat_xyzw: Array, vector: Array, w: Array) -> Array:
    """V + w t + u × t with t = 2 u × v, written out: it is on every control path, and arrays here are short.

    The inverse rotation is the same with -w, since q and -q are one rotation.
    """
    x, y, z = quat_xyzw[..., 0], quat_xyzw[..., 1], quat_xyzw[..., 2]
    a, b, c = vector[..., 0], vector[..., 1], vector[..., 2]
    tx, ty, tz = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return side_by_side(
        a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz, c + w * tz + x * ty - y * tx
    )


def turned(quat_xyzw: Sequence[float], vector: Sequence[float]) -> tuple[float, float, float]:
    """`rotate` of one vector in plain numbers, to the last bit: arrays of three cost five times it."""
    x, y, z, w = quat_xyzw
    a, b, c = vector
    tx, ty, tz = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz, c + w * tz + x * ty - y * tx


def turn_between(a: Sequence[float], b: Sequence[float]) -> tuple[float, float, float, float]:
    """Conjugate of one unit quaternion times another, `multiply` in plain numbers: by it the body turns from a to b."""
    px, py, pz, pw = -a[0], -a[1], -a[2], a[3]
    qx, qy, qz, qw = b
    return (
        pw * qx + px * qw + py * qz - pz * qy,
        pw * qy - px * qz + py * qw + pz * qx,
        pw * qz + px * qy - py * qx + pz * qw,
        pw * qw - px * qx - py * qy - pz * qz,
    )


def cross(a: Array, b: Array) -> Array:
    """Cross product over the last axis, shapes (..., 3)."""
    a0, a1, a2 = a[..., 0], a[..., 1], a[..., 2]
    b0, b1, b2 = b[..., 0], b[..., 1], b[..., 2]
    return side_by_side(a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0)


def multiply(p_xyzw: Array, q_xyzw: Array) -> Array:
    """Hamilton product p ⊗ q, shapes (..., 4)."""
    px, py, pz, pw = (p_xyzw[..., i] for i in range(4))
    qx, qy, qz, qw = (q_xyzw[..., i] for i in range(4))
    return side_by_side(
        pw * qx + px * qw + py * qz - pz * qy,
        pw * qy - px * qz + py * qw + pz * qx,
        pw * qz + px * qy - py * qx + pz * qw,
        pw * qw - px * qx - py * qy - pz * qz,
    )


def from_yaw(yaw: Array) -> Array:
    """Quaternion of a rotation about +z, shape (...,) [rad] to (..., 4)."""
    xp = array_namespace(yaw)
    zero = xp.zeros_like(yaw)
    return side_by_side(zero, zero, xp.sin(0.5 * yaw), xp.cos(0.5 * yaw))


def yaw_of(quat_xyzw: Array) -> Array:
    """Heading: angle of the body's x axis about the world's z axis.

    Args:
        quat_xyzw: Unit quaternion, shape (..., 4).

    Returns:
        Yaw, shape (...,) [rad], in (-pi, pi].
    """
    xp = array_namespace(quat_xyzw)
    x, y, z, w = quat_xyzw[..., 0], quat_xyzw[..., 1], quat_xyzw[..., 2], quat_xyzw[..., 3]
    return xp.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def size_of(vector: np.ndarray) -> float:
    """Length of one vector, shape (n,), with the bits of `np.linalg.norm`, which takes ten times as long for so few."""
    return math.sqrt(vector.dot(vector))


def wrap_angle(angle: Array) -> Array:
    """Same angle in [-pi, pi], any shape [rad]."""
    xp = array_namespace(angle)
    return xp.atan2(xp.sin(angle), xp.cos(angle))
