"""Vectors and attitudes of bodies that turn freely, in a batch: exponential, logarithm, products, Euler angles, draws.

Vectors are three arrays and unit quaternions four, in ROS order (x, y, z, w), each of the leading shape (...,):
thousands of worlds then lie side by side in memory. `rotation.py` has the algebra of single robots and wires, with the
component axis last.

Formulas: Solà, "Quaternion kinematics for the error-state Kalman filter", arXiv 1711.02508, §1 and §2, whose order is
w first.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.rotation import Array

Vector = tuple[Array, Array, Array]
Quaternion = tuple[Array, Array, Array, Array]
Tensor = tuple[
    Array, ...
]  # entries xx, yy, zz, xy, xz, yz of a symmetric one, or the first three: the rest is zero


def plus(a: Vector, b: Vector) -> Vector:
    """Sum of two vectors."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def minus(a: Vector, b: Vector) -> Vector:
    """Difference of two vectors."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def scaled(factor: Any, a: Vector) -> Vector:
    """Vector times a number, or times an array of the leading shape."""
    return factor * a[0], factor * a[1], factor * a[2]


def dot(a: Vector, b: Vector) -> Array:
    """Scalar product of two vectors, shape (...,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def length(a: Vector) -> Array:
    """Length of a vector, shape (...,)."""
    return array_namespace(a[0]).sqrt(dot(a, a))


def product(p: Quaternion, q: Quaternion) -> Quaternion:
    """Hamilton product p ⊗ q: first q turns, then p (Solà eq. 12)."""
    px, py, pz, pw = p
    qx, qy, qz, qw = q
    return (
        pw * qx + px * qw + py * qz - pz * qy,
        pw * qy - px * qz + py * qw + pz * qx,
        pw * qz + px * qy - py * qx + pz * qw,
        pw * qw - px * qx - py * qy - pz * qz,
    )


def conjugate(q: Quaternion) -> Quaternion:
    """Opposite rotation."""
    return -q[0], -q[1], -q[2], q[3]


def normalised(q: Quaternion) -> Quaternion:
    """The same direction with length 1."""
    x, y, z, w = q
    share = 1.0 / array_namespace(x).sqrt(x * x + y * y + z * z + w * w)
    return share * x, share * y, share * z, share * w


def turn(q: Quaternion, vector: Vector) -> Vector:
    """Express a vector of the body in the world."""
    return _turned(q, vector, q[3])


def turn_back(q: Quaternion, vector: Vector) -> Vector:
    """Express a vector of the world in the body."""
    return _turned(q, vector, -q[3])


def _turned(q: Quaternion, vector: Vector, w: Array) -> Vector:
    """V + w t + u × t with t = 2 u × v; the opposite rotation is the same with -w."""
    x, y, z, _ = q
    a, b, c = vector
    tx, ty, tz = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz, c + w * tz + x * ty - y * tx


def exponential(rotation: Vector) -> Quaternion:
    """Unit quaternion of a rotation vector (Solà eq. 101).

    Args:
        rotation: Axis times angle [rad]; to the last bit up to half a turn, to 1e-12 up to 4.5 rad, and to
            1e-9 up to a turn.
    """
    half_squared = 0.25 * dot(rotation, rotation)
    # Powers instead of sine over angle: no division by zero, and at 1 rad exact to the last bit of float64.
    s = 1.0 + half_squared / -272.0 * (1.0 + half_squared / -342.0)
    for divisor in (210.0, 156.0, 110.0, 72.0, 42.0, 20.0, 6.0):
        s = 1.0 - half_squared * (1.0 / divisor) * s
    xp = array_namespace(half_squared)
    return (*scaled(0.5 * s, rotation), xp.cos(xp.sqrt(half_squared)))


def logarithm(q: Quaternion) -> Vector:
    """Rotation vector of a unit quaternion, at most half a turn (Solà eq. 105).

    Args:
        q: q and -q give the same, but for exactly half a turn.

    Returns:
        Axis times angle [rad], of length 0 to pi.
    """
    x, y, z, w = q
    xp = array_namespace(x)
    if isinstance(w, float):  # of one robot, without the arrays of ones and what `where` computes for nothing
        sign = -1.0 if w < 0.0 else 1.0
        sine, w = xp.sqrt(x * x + y * y + z * z), sign * w
        factor = sign * (2.0 / max(w, 0.5) if sine < 1e-6 else 2.0 * xp.atan2(sine, w) / sine)
        return scaled(factor, (x, y, z))
    one = xp.ones_like(w)
    sign = xp.where(w < 0.0, -one, one)
    sine, w = xp.sqrt(x * x + y * y + z * z), sign * w
    tiny = sine < 1e-6
    safe = xp.where(tiny, one, sine)
    factor = sign * xp.where(tiny, 2.0 / clip(w, 0.5, None), 2.0 * xp.atan2(sine, w) / safe)
    return scaled(factor, (x, y, z))


def rotation_error(q: Quaternion, target: Quaternion) -> Vector:
    """Rotation from an attitude to a target, in the body's frame: Log(q⁻¹ ⊗ target).

    Returns:
        Axis times angle [rad]; turning the body by it gives the target.
    """
    return logarithm(product(conjugate(q), target))


def angle_between(q: Quaternion, target: Quaternion) -> Array:
    """Angle of the rotation between two attitudes, shape (...,) [rad], 0 to pi.

    Uses atan2 instead of acos: acos loses half the digits at small angles.
    """
    x, y, z, w = product(conjugate(q), target)
    xp = array_namespace(x)
    return 2.0 * xp.atan2(xp.sqrt(x * x + y * y + z * z), xp.abs(w))


def first_rows(q: Quaternion) -> tuple[Array, Array, Array, Array, Array, Array]:
    """First two rows of the rotation matrix from body to world: an attitude without jumps for a network.

    Zhou et al., "On the Continuity of Rotation Representations in Neural Networks", CVPR 2019: representations of
    four or fewer numbers jump somewhere; these six do not.
    """
    x, y, z, w = q
    return (
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - w * z),
        2.0 * (x * z + w * y),
        2.0 * (x * y + w * z),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - w * x),
    )


def from_euler(roll: Array, pitch: Array, yaw: Array) -> Quaternion:
    """Quaternion of roll about x, then pitch about y, then yaw about z of the world (REP-103), shapes (...,) [rad]."""
    xp = array_namespace(roll)
    cr, sr = xp.cos(0.5 * roll), xp.sin(0.5 * roll)
    cp, sp = xp.cos(0.5 * pitch), xp.sin(0.5 * pitch)
    cy, sy = xp.cos(0.5 * yaw), xp.sin(0.5 * yaw)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def euler_of(q: Quaternion) -> Vector:
    """Roll, pitch and yaw as `from_euler` takes them [rad].

    At a pitch of ± 90° roll and yaw turn about one axis; yaw then takes all of it.
    """
    x, y, z, w = q
    xp = array_namespace(x)
    sine = clip(2.0 * (w * y - x * z), -1.0, 1.0)
    regular = xp.abs(sine) < 1.0 - 1e-12
    roll = xp.where(regular, xp.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)), xp.zeros_like(x))
    yaw = xp.where(
        regular,
        xp.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
        xp.atan2(-2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z)),
    )
    return roll, xp.asin(sine), yaw


def uniform_attitude(first: Array, second: Array, third: Array, *, tilt_deg: float = 180.0) -> Quaternion:
    """Attitude from three numbers that are uniform in [0, 1): uniform over all rotations that tilt no further [deg].

    Shoemake, "Uniform random rotations", Graphics Gems III, 1992. Euler angles that are each uniform would crowd at the
    poles, as the starts of RANS do (thesis §3.3.6).
    """
    xp = array_namespace(first)
    if tilt_deg < 180.0:
        # The body's z axis is uniform over a cap of the sphere, which the heading turns under.
        tilt = xp.acos(1.0 - (1.0 - math.cos(math.radians(tilt_deg))) * first)
        towards, zero = 2.0 * math.pi * second, 0.0 * first
        leaning = exponential((tilt * xp.cos(towards), tilt * xp.sin(towards), zero))
        return product(leaning, from_euler(zero, zero, 2.0 * math.pi * third))
    low, high = xp.sqrt(1.0 - first), xp.sqrt(first)
    a, b = 2.0 * math.pi * second, 2.0 * math.pi * third
    return low * xp.sin(a), low * xp.cos(a), high * xp.sin(b), high * xp.cos(b)


def uniform_direction(first: Array, second: Array) -> Vector:
    """Unit vector that is uniform over the sphere, from two numbers that are uniform in [0, 1)."""
    xp = array_namespace(first)
    up = 2.0 * first - 1.0
    across = xp.sqrt(clip(1.0 - up * up, 0.0, None))
    angle = 2.0 * math.pi * second
    return across * xp.cos(angle), across * xp.sin(angle), up


def even_directions(count: int) -> np.ndarray:
    """Unit vectors spread evenly over the sphere, shape (count, 3).

    A Fibonacci lattice: González, Mathematical Geosciences 42, 2010.
    """
    number = np.arange(count) + 0.5
    up, angle = 1.0 - 2.0 * number / count, math.pi * (1.0 + math.sqrt(5.0)) * number
    across = np.sqrt(1.0 - up * up)
    return np.stack((across * np.cos(angle), across * np.sin(angle), up), axis=-1)


def times(tensor: Tensor, vector: Vector) -> Vector:
    """Symmetric tensor times vector."""
    x, y, z = vector
    if len(tensor) == 3:
        return tensor[0] * x, tensor[1] * y, tensor[2] * z
    xx, yy, zz, xy, xz, yz = tensor
    return xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z
