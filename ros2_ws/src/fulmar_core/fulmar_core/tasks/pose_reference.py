"""A pose that moves: where it is between poses that lie apart in time, how it moves there, and how that changes."""

from __future__ import annotations

from dataclasses import dataclass

from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.attitude import Quaternion, Vector, conjugate, minus, product, turn, turn_back
from fulmar_core.states.rotation import Array
from fulmar_core.states.spatial import SpatialState, quat_of


@dataclass(frozen=True)
class Reference:
    """A target at one moment: pose (..., 7), motion and its change (..., 6); units and frames: see `moving_pose`."""

    pose: Array
    motion: Array
    change: Array


def between(targets: Array, before: Array, part: Array, step: float) -> Reference:
    """The target a part of the way from one of its poses to the next.

    Place and quaternion are cubic in time with the slopes of their neighbours (Catmull and Rom 1974).

    Args:
        targets: Its poses, shape (..., k, 7).
        before: Number of the pose before, shape (...,).
        part: Of the way to the next one, shape (..., 1).
        step: Time from one to the next [s].
    """
    xp, last = array_namespace(targets), targets.shape[-2] - 1

    def pose(further: int) -> Array:
        which = xp.astype(clip(before + further, 0.0, float(last)), xp.int64)
        return xp.take_along_axis(targets, which[..., None, None], axis=-2)[..., 0, :]

    a, b, c, d = (pose(further) for further in (-1, 0, 1, 2))
    if last > 1:  # beyond the ends it goes on with the acceleration that it has there
        a = xp.where(before[..., None] < 0.5, 3.0 * (b - c) + d, a)
        d = xp.where(before[..., None] > last - 1.5, 3.0 * (c - b) + a, d)
    first, second, third = c - a, 2.0 * a - 5.0 * b + 4.0 * c - d, 3.0 * (b - c) + d - a
    here = b + 0.5 * part * (first + part * (second + part * third))
    rate = 0.5 * (first + part * (2.0 * second + 3.0 * part * third)) / step
    change = (second + 3.0 * part * third) / (step * step)
    size = xp.sqrt(xp.sum(here[..., 3:] ** 2, axis=-1, keepdims=True))
    quat = here[..., 3:] / size
    return Reference(
        xp.concat((here[..., :3], quat), axis=-1),
        xp.concat((rate[..., :3], turning(quat, rate[..., 3:] / size)), axis=-1),
        xp.concat((change[..., :3], turning(quat, change[..., 3:] / size)), axis=-1),
    )


def motion_errors(state: SpatialState, now: Reference) -> tuple[Vector, Vector]:
    """Velocity [m/s] and turn rate [rad/s] of the target less those of a body, along the body's axes."""
    to_target = product(conjugate(state.quat), quat_of(now.pose))
    along = turn_back(state.quat, vector_of(now.motion))
    about = turn(to_target, vector_of(now.motion[..., 3:]))
    return minus(along, state.velocity_in_body), minus(about, state.rate)


def turning(quat: Array, change: Array) -> Array:
    """Twice the vector of q⁻¹ ⊗ its derivative: a turn rate about the body's axes (Solà eq. 200), shape (..., 3).

    Of the second derivative it is the change of that rate, since the product of two first ones has no vector.
    """
    x, y, z, _ = product(conjugate(_quat(quat)), _quat(change))
    return 2.0 * array_namespace(quat).stack((x, y, z), axis=-1)


def vector_of(columns: Array) -> Vector:
    """The first three of some columns, each of the leading shape."""
    return columns[..., 0], columns[..., 1], columns[..., 2]


def _quat(columns: Array) -> Quaternion:
    return columns[..., 0], columns[..., 1], columns[..., 2], columns[..., 3]
