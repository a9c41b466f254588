"""Attitudes of bodies that turn freely: exponential and logarithm, products, Euler angles, uniform draws.

Unit quaternions with the component axis first, shape (4, ...), in ROS order (x, y, z, w): thousands of worlds then lie
side by side in memory. `rotation.py` has the same algebra with the component axis last, for wires and single robots.

Formulas: Solà, "Quaternion kinematics for the error-state Kalman filter", arXiv 1711.02508, §1 and §2, whose order is
w first.
"""

from __future__ import annotations

import math

from fulmar_core.arrays import array_namespace, clip
from fulmar_core.rotation import Array


def vector_cross(a: Array, b: Array) -> Array:
    """Cross product of vectors, shapes (3, ...)."""
    return array_namespace(a).stack(
        (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
    )


def dot(a: Array, b: Array) -> Array:
    """Scalar product over the first axis, shapes (k, ...) to (...,), in one order whatever the number of worlds."""
    total = a[0] * b[0]
    for i in range(1, a.shape[0]):
        total = total + a[i] * b[i]
    return total


def norm(a: Array) -> Array:
    """Length over the first axis, shapes (k, ...) to (...,)."""
    return array_namespace(a).sqrt(dot(a, a))


def product(p: Array, q: Array) -> Array:
    """Hamilton product p ⊗ q, shapes (4, ...): first q turns, then p (Solà eq. 12)."""
    px, py, pz, pw = p
    qx, qy, qz, qw = q
    return array_namespace(p).stack(
        (
            pw * qx + px * qw + py * qz - pz * qy,
            pw * qy - px * qz + py * qw + pz * qx,
            pw * qz + px * qy - py * qx + pz * qw,
            pw * qw - px * qx - py * qy - pz * qz,
        )
    )


def inverse(q: Array) -> Array:
    """Opposite rotation, shape (4, ...)."""
    return array_namespace(q).stack((-q[0], -q[1], -q[2], q[3]))


def normalised(q: Array) -> Array:
    """The same direction with length 1, shape (4, ...)."""
    return q / norm(q)


def turn(q: Array, vector: Array) -> Array:
    """Express vectors of the body, shape (3, ...), in the world."""
    return _turned(q, vector, q[3])


def turn_back(q: Array, vector: Array) -> Array:
    """Express vectors of the world, shape (3, ...), in the body."""
    return _turned(q, vector, -q[3])


def _turned(q: Array, vector: Array, w: Array) -> Array:
    """V + w t + u × t with t = 2 u × v; the opposite rotation is the same with -w."""
    x, y, z = q[0], q[1], q[2]
    a, b, c = vector[0], vector[1], vector[2]
    tx, ty, tz = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return array_namespace(q).stack(
        (a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz, c + w * tz + x * ty - y * tx)
    )


def exponential(rotation: Array) -> Array:
    """Unit quaternion of a rotation vector (Solà eq. 101).

    Args:
        rotation: Axis times angle, shape (3, ...) [rad]; to the last bit up to half a turn, to 1e-12 up to a turn.

    Returns:
        Shape (4, ...).
    """
    xp = array_namespace(rotation)
    half_squared = 0.25 * dot(rotation, rotation)
    # Powers instead of sine over angle: no division by zero, and at 1 rad exact to the last bit of float64.
    s = 1.0 + half_squared / -272.0 * (1.0 + half_squared / -342.0)
    for divisor in (210.0, 156.0, 110.0, 72.0, 42.0, 20.0, 6.0):
        s = 1.0 - half_squared / divisor * s
    s = 0.5 * s
    return xp.stack((s * rotation[0], s * rotation[1], s * rotation[2], xp.cos(xp.sqrt(half_squared))))


def logarithm(q: Array) -> Array:
    """Rotation vector of a unit quaternion, at most half a turn (Solà eq. 105).

    Args:
        q: Shape (4, ...); q and -q give the same, but for exactly half a turn.

    Returns:
        Axis times angle, shape (3, ...) [rad], of length 0 to pi.
    """
    xp = array_namespace(q)
    sign = xp.where(q[3] < 0.0, -xp.ones_like(q[3]), xp.ones_like(q[3]))
    x, y, z, w = sign * q[0], sign * q[1], sign * q[2], sign * q[3]
    sine = xp.sqrt(x * x + y * y + z * z)
    tiny = sine < 1e-6
    safe = xp.where(tiny, xp.ones_like(sine), sine)
    factor = xp.where(tiny, 2.0 / clip(w, 0.5, None), 2.0 * xp.atan2(sine, w) / safe)
    return xp.stack((factor * x, factor * y, factor * z))


def rotation_error(q: Array, target: Array) -> Array:
    """Rotation from an attitude to a target, in the body's frame: Log(q⁻¹ ⊗ target).

    Args:
        q: Attitude of the body, shape (4, ...).
        target: Attitude it shall have, shape (4, ...).

    Returns:
        Axis times angle, shape (3, ...) [rad]; turning the body by it gives the target.
    """
    return logarithm(product(inverse(q), target))


def angle_between(q: Array, target: Array) -> Array:
    """Angle of the rotation between two attitudes, shapes (4, ...) to (...,) [rad], 0 to pi.

    Uses atan2 instead of acos: acos loses half the digits at small angles.
    """
    xp = array_namespace(q)
    x, y, z, w = product(inverse(q), target)
    return 2.0 * xp.atan2(xp.sqrt(x * x + y * y + z * z), xp.abs(w))


def first_rows(q: Array) -> Array:
    """First two rows of the rotation matrix from body to world: an attitude without jumps for a network.

    Zhou et al., "On the Continuity of Rotation Representations in Neural Networks", CVPR 2019: representations of
    four or fewer numbers jump somewhere; these six do not.

    Args:
        q: Shape (4, ...).

    Returns:
        Shape (6, ...) [-].
    """
    x, y, z, w = q
    return array_namespace(q).stack(
        (
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - w * z),
            2.0 * (x * z + w * y),
            2.0 * (x * y + w * z),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - w * x),
        )
    )


def from_euler(roll: Array, pitch: Array, yaw: Array) -> Array:
    """Quaternion of roll about x, then pitch about y, then yaw about z of the world (REP-103), shapes (...,) [rad]."""
    xp = array_namespace(roll)
    cr, sr = xp.cos(0.5 * roll), xp.sin(0.5 * roll)
    cp, sp = xp.cos(0.5 * pitch), xp.sin(0.5 * pitch)
    cy, sy = xp.cos(0.5 * yaw), xp.sin(0.5 * yaw)
    return xp.stack(
        (
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        )
    )


def euler_of(q: Array) -> Array:
    """Roll, pitch and yaw as `from_euler` takes them, shape (4, ...) to (3, ...) [rad].

    At a pitch of ± 90° roll and yaw turn about one axis; yaw then takes all of it.
    """
    xp = array_namespace(q)
    x, y, z, w = q
    pitch = xp.asin(clip(2.0 * (w * y - x * z), -1.0, 1.0))
    regular = xp.abs(2.0 * (w * y - x * z)) < 1.0 - 1e-12
    roll = xp.where(regular, xp.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)), xp.zeros_like(x))
    yaw = xp.where(
        regular,
        xp.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
        xp.atan2(-2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z)),
    )
    return xp.stack((roll, pitch, yaw))


def uniform_attitude(first: Array, second: Array, third: Array) -> Array:
    """Attitude that is uniform over all rotations, from three numbers that are uniform in [0, 1).

    Shoemake, "Uniform random rotations", Graphics Gems III, 1992. Euler angles that are each uniform would crowd at the
    poles, as the starts of RANS do (thesis §3.3.6).

    Returns:
        Shape (4, ...).
    """
    xp = array_namespace(first)
    low, high = xp.sqrt(1.0 - first), xp.sqrt(first)
    a, b = 2.0 * math.pi * second, 2.0 * math.pi * third
    return xp.stack((low * xp.sin(a), low * xp.cos(a), high * xp.sin(b), high * xp.cos(b)))


def uniform_direction(first: Array, second: Array) -> Array:
    """Unit vector that is uniform over the sphere, from two numbers that are uniform in [0, 1), shape (3, ...)."""
    xp = array_namespace(first)
    up = 2.0 * first - 1.0
    across = xp.sqrt(clip(1.0 - up * up, 0.0, None))
    angle = 2.0 * math.pi * second
    return xp.stack((across * xp.cos(angle), across * xp.sin(angle), up))
