"""Motion in the plane z = 0: what planar robots, their tasks and their controllers compute with.

One array for each quantity, so that thousands of worlds lie side by side in memory.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import partial
from operator import attrgetter, itemgetter
from typing import Any

import numpy as np

from fulmar_core.arrays import array_namespace
from fulmar_core.rotation import Array, from_yaw
from fulmar_core.state import RigidBodyState

PlanarWrench = tuple[float, float, float]  # force along the world's x and y [N], yaw moment [N·m]


@dataclass(frozen=True, slots=True)
class PlanarState:
    """Pose and motion of one body in the plane, or of many; every array has the shape (...,)."""

    x: Array  # in the world [m]
    y: Array  # in the world [m]
    yaw: Array  # of the body's x axis in the world, any multiple of a turn added [rad]
    vx: Array  # along the world's x [m/s]
    vy: Array  # along the world's y [m/s]
    yaw_rate: Array  # [rad/s]

    def __getitem__(self, index: Any) -> PlanarState:
        """Pick worlds out of a batch."""
        return PlanarState(*map(itemgetter(index), _columns(self)))

    def write(self, index: Any, other: PlanarState) -> None:
        """Overwrite some worlds of a batch in place, as a reset does."""
        for name in COLUMNS:
            getattr(self, name)[index] = getattr(other, name)

    @property
    def speed(self) -> Array:
        """Length of the velocity [m/s]."""
        return array_namespace(self.vx).sqrt(self.vx * self.vx + self.vy * self.vy)

    @property
    def velocity_in_body(self) -> tuple[Array, Array]:
        """Velocity ahead and to the left [m/s]."""
        return to_body(self.yaw, self.vx, self.vy)


COLUMNS = tuple(f.name for f in fields(PlanarState))
_columns = attrgetter(*COLUMNS)
_float64 = partial(np.asarray, dtype=float)


def to_body(yaw: Array, x: Array, y: Array) -> tuple[Array, Array]:
    """Turn a vector of the world into a body's frame, shapes (...,)."""
    xp = array_namespace(yaw)
    c, s = xp.cos(yaw), xp.sin(yaw)
    return c * x + s * y, c * y - s * x


def wrapped(angle: Array) -> Array:
    """Same angle in [-pi, pi], any shape [rad]; cheaper than by sine and cosine."""
    xp = array_namespace(angle)
    return angle - 2.0 * np.pi * xp.round(angle * (0.5 / np.pi))


def at_rest(x: Array, y: Array, yaw: Array) -> PlanarState:
    """A body that stands still at a pose, shapes (...,) [m, m, rad]."""
    zero = array_namespace(x).zeros_like(x)
    return PlanarState(x, y, yaw, zero, zero, zero)


def in_float64(state: PlanarState) -> PlanarState:
    """The same state as NumPy arrays of float64."""
    return PlanarState(*map(_float64, _columns(state)))


def planar_of(state: RigidBodyState) -> PlanarState:
    """The planar part of a rigid-body state."""
    position, velocity = state.position_in_world, state.velocity_in_world
    return PlanarState(
        position[..., 0],
        position[..., 1],
        state.yaw,
        velocity[..., 0],
        velocity[..., 1],
        state.angular_velocity_in_body[..., 2],
    )


def rigid_of(state: PlanarState) -> RigidBodyState:
    """The rigid-body state of a planar one: z, roll, pitch and their rates are zero."""
    xp = array_namespace(state.x)
    zero = xp.zeros_like(state.x)
    return RigidBodyState(
        xp.stack((state.x, state.y, zero), axis=-1),
        from_yaw(state.yaw),
        xp.stack((state.vx, state.vy, zero), axis=-1),
        xp.stack((zero, zero, state.yaw_rate), axis=-1),
    )


def stack_planar(states: list[PlanarState], axis: int = 0) -> PlanarState:
    """Join states of one shape along a new axis, as NumPy."""
    return PlanarState(*(np.stack([getattr(s, name) for s in states], axis=axis) for name in COLUMNS))
