"""Motion in the plane z = 0: what planar robots, their tasks and their controllers compute with.

One array for each quantity, so that thousands of worlds lie side by side in memory.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from fulmar_core.states.arrays import array_namespace, side_by_side
from fulmar_core.states.rotation import Array, from_yaw, yaw_of
from fulmar_core.states.state import POSE, RigidBodyState, State

PlanarWrench = tuple[float, float, float]  # force along the world's x and y [N], yaw moment [N·m]


@dataclass(frozen=True, slots=True)
class PlanarState(State):
    """Pose and motion of one body in the plane, or of many; every array has the shape (...,).

    Targets are poses (x [m], y [m], yaw [rad]), or twists (ahead [m/s], to the left [m/s], turn rate [rad/s]).
    """

    x: Array  # in the world [m]
    y: Array  # in the world [m]
    yaw: Array  # of the body's x axis in the world, any multiple of a turn added [rad]
    vx: Array  # along the world's x [m/s]
    vy: Array  # along the world's y [m/s]
    yaw_rate: Array  # [rad/s]

    COLUMNS: ClassVar[tuple[str, ...]] = ("x", "y", "yaw", "vx", "vy", "yaw_rate")
    WORLD: ClassVar[str] = "two dimensions"
    NUMBERS: ClassVar[tuple[str, ...]] = ("x", "y", "deg")
    AXES: ClassVar[int] = 2
    SUFFIX: ClassVar[str] = ""

    def columns(self) -> tuple[Array, ...]:
        """Every array, in the order of `COLUMNS`."""
        return self.x, self.y, self.yaw, self.vx, self.vy, self.yaw_rate

    @classmethod
    def from_rigid(cls, state: RigidBodyState) -> Self:
        """The planar part of a rigid-body state."""
        position, velocity = state.position_in_world, state.velocity_in_world
        return cls(
            position[..., 0],
            position[..., 1],
            yaw_of(state.quat_xyzw),
            velocity[..., 0],
            velocity[..., 1],
            state.angular_velocity_in_body[..., 2],
        )

    def to_rigid(self) -> RigidBodyState:
        """The same with z, roll, pitch and their rates zero."""
        zero = array_namespace(self.x).zeros_like(self.x)
        return RigidBodyState(
            side_by_side(self.x, self.y, zero),
            from_yaw(self.yaw),
            side_by_side(self.vx, self.vy, zero),
            side_by_side(zero, zero, self.yaw_rate),
        )

    @classmethod
    def targets_of(cls, rigid: Array) -> Array:
        """Place and heading of poses, shape (..., 7); or what twists, shape (..., 6), have in the plane."""
        turn = yaw_of(rigid[..., 3:]) if rigid.shape[-1] == POSE else rigid[..., 5]
        return array_namespace(rigid).stack((rigid[..., 0], rigid[..., 1], turn), axis=-1)

    @classmethod
    def rigid_targets(cls, targets: Array, *, twists: bool) -> Array:
        """Poses, shape (..., 7), or twists, shape (..., 6), of targets in the plane, shape (..., 3)."""
        xp = array_namespace(targets)
        x, y, turn = (targets[..., i] for i in range(3))
        zero = xp.zeros_like(x)
        if twists:
            return xp.stack((x, y, zero, zero, zero, turn), axis=-1)
        return xp.concat((xp.stack((x, y, zero), axis=-1), from_yaw(turn)), axis=-1)

    @classmethod
    def target_at(cls, numbers: Sequence[float]) -> np.ndarray:
        """x, y and heading, shape (3,); without a heading it is 0."""
        x, y, *angles = numbers
        (heading,) = angles or (0.0,)
        return np.array([x, y, math.radians(heading)])

    @classmethod
    def written(cls, target: Array) -> tuple[float, ...]:
        """Place [m] and heading [deg], which is from -180 to 180."""
        return float(target[0]), float(target[1]), math.degrees(float(wrapped(np.asarray(target[2]))))

    @classmethod
    def resting(cls, target: Array) -> Self:
        """A body that stands still at a pose, shape (..., 3)."""
        x, y, yaw = (target[..., i] for i in range(3))
        return cls(x, y, yaw, x, x, x).stopped()

    @property
    def pose(self) -> Array:
        """Where it is, as a target, shape (..., 3)."""
        return array_namespace(self.x).stack((self.x, self.y, self.yaw), axis=-1)

    def stopped(self) -> Self:
        """The same pose at rest."""
        zero = array_namespace(self.x).zeros_like(self.x)
        return type(self)(self.x, self.y, self.yaw, zero, zero, zero)

    def distance_to(self, target: Array) -> Array:
        """Distance from the place of a target, shape (...,) [m]."""
        dx, dy = target[..., 0] - self.x, target[..., 1] - self.y
        return array_namespace(dx).sqrt(dx * dx + dy * dy)

    def logged(self) -> dict[str, Array]:
        """Place, heading, speed and turn rate."""
        return {"x": self.x, "y": self.y, "yaw": self.yaw, "speed": self.speed, "yaw_rate": self.yaw_rate}

    @property
    def speed(self) -> Array:
        """Length of the velocity [m/s]."""
        return array_namespace(self.vx).sqrt(self.vx * self.vx + self.vy * self.vy)

    @property
    def velocity_in_body(self) -> tuple[Array, Array]:
        """Velocity ahead and to the left [m/s]."""
        return to_body(self.yaw, self.vx, self.vy)


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
    return PlanarState(x, y, yaw, x, x, x).stopped()
