"""Motion in space: what free flyers, their tasks and their controllers compute with."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from fulmar_core.states.arrays import array_namespace, side_by_side
from fulmar_core.states.attitude import Quaternion, Vector, euler_of, from_euler, length, minus, turn_back
from fulmar_core.states.rotation import Array
from fulmar_core.states.state import RigidBodyState, State


@dataclass(frozen=True, slots=True)
class SpatialState(State):
    """Pose and motion of one rigid body in space, or of many; every array has the shape (...,).

    Targets are poses (x, y, z [m], quaternion x, y, z, w), or twists in the body's frame (three velocities [m/s], three
    turn rates [rad/s]).
    """

    x: Array  # in the world [m]
    y: Array  # in the world [m]
    z: Array  # in the world [m]
    qx: Array  # attitude of the body in the world, a unit quaternion [-]
    qy: Array
    qz: Array
    qw: Array
    vx: Array  # along the world's x [m/s]
    vy: Array  # along the world's y [m/s]
    vz: Array  # along the world's z [m/s]
    wx: Array  # turn rate about the body's x [rad/s]
    wy: Array  # about the body's y [rad/s]
    wz: Array  # about the body's z [rad/s]

    COLUMNS: ClassVar[tuple[str, ...]] = (
        "x", "y", "z", "qx", "qy", "qz", "qw", "vx", "vy", "vz", "wx", "wy", "wz",
    )  # fmt: skip

    def columns(self) -> tuple[Array, ...]:
        """Every array, in the order of `COLUMNS`."""
        return (*self.position, *self.quat, *self.velocity, *self.rate)

    WORLD: ClassVar[str] = "space"
    NUMBERS: ClassVar[tuple[str, ...]] = ("x", "y", "z", "roll", "pitch", "yaw")
    AXES: ClassVar[int] = 3
    SUFFIX: ClassVar[str] = "_3d"

    @property
    def position(self) -> Vector:
        """In the world [m]."""
        return self.x, self.y, self.z

    @property
    def quat(self) -> Quaternion:
        """Attitude of the body in the world (x, y, z, w)."""
        return self.qx, self.qy, self.qz, self.qw

    @property
    def velocity(self) -> Vector:
        """Along the world's axes [m/s]."""
        return self.vx, self.vy, self.vz

    @property
    def rate(self) -> Vector:
        """Turn rate about the body's axes [rad/s]."""
        return self.wx, self.wy, self.wz

    @property
    def velocity_in_body(self) -> Vector:
        """Velocity along the body's axes [m/s]."""
        return turn_back(self.quat, self.velocity)

    @classmethod
    def from_rigid(cls, state: RigidBodyState) -> Self:
        """The same thirteen numbers."""
        parts = (
            state.position_in_world,
            state.quat_xyzw,
            state.velocity_in_world,
            state.angular_velocity_in_body,
        )
        return cls(*(part[..., i] for part in parts for i in range(part.shape[-1])))

    @classmethod
    def columns_of(cls, state: RigidBodyState) -> np.ndarray:
        """See `State.columns_of`."""
        parts = (
            state.position_in_world,
            state.quat_xyzw,
            state.velocity_in_world,
            state.angular_velocity_in_body,
        )
        return np.concatenate(parts)[:, None]

    def to_rigid(self) -> RigidBodyState:
        """The same thirteen numbers."""
        parts = (self.position, self.quat, self.velocity, self.rate)
        return RigidBodyState(*(side_by_side(*part) for part in parts))

    @classmethod
    def targets_of(cls, rigid: Array) -> Array:
        """Poses and twists as they are."""
        return rigid

    @classmethod
    def rigid_targets(cls, targets: Array, *, twists: bool) -> Array:
        """Targets as they are."""
        return targets

    @classmethod
    def target_at(cls, numbers: Sequence[float]) -> np.ndarray:
        """Place and attitude, shape (7,); without angles the body's axes are those of the world."""
        x, y, z, *angles = numbers
        roll, pitch, yaw = np.deg2rad(angles or (0.0, 0.0, 0.0))
        return np.array([x, y, z, *from_euler(roll, pitch, yaw)])

    @classmethod
    def written(cls, target: Array) -> tuple[float, ...]:
        """Place [m], and roll, pitch, yaw [deg]."""
        place = tuple(float(part) for part in target[:3])
        angles = euler_of(quat_of(np.asarray(target, dtype=float)))
        return *place, *(math.degrees(float(angle)) for angle in angles)

    @classmethod
    def resting(cls, target: Array) -> Self:
        """A body that stands still at a pose, shape (..., 7)."""
        return cls.at_rest(position_of(target), quat_of(target))

    @classmethod
    def at_rest(cls, position: Vector, quat: Quaternion) -> Self:
        """The same, at a place [m] with an attitude."""
        return cls(*position, *quat, *position, *position).stopped()

    @property
    def pose(self) -> Array:
        """Where it is, as a target, shape (..., 7)."""
        return array_namespace(self.x).stack((*self.position, *self.quat), axis=-1)

    def stopped(self) -> Self:
        """The same pose at rest."""
        zero = array_namespace(self.x).zeros_like(self.x)
        return type(self)(*self.position, *self.quat, *((zero,) * 6))

    def distance_to(self, target: Array) -> Array:
        """Distance from the place of a target, shape (...,) [m]."""
        return length(minus(position_of(target), self.position))

    def logged(self) -> dict[str, Array]:
        """Place, yaw, speed and length of the turn rate."""
        place = {"x": self.x, "y": self.y, "z": self.z, "yaw": euler_of(self.quat)[2]}
        return place | {"speed": length(self.velocity), "yaw_rate": length(self.rate)}


def position_of(target: Array) -> Vector:
    """Place of a target, shape (..., 7) or (..., 3) [m]."""
    return target[..., 0], target[..., 1], target[..., 2]


def quat_of(target: Array) -> Quaternion:
    """Attitude of a target, shape (..., 7)."""
    return target[..., 3], target[..., 4], target[..., 5], target[..., 6]
