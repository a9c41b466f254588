"""The rigid-body state every part of Fulmar speaks: 6-DoF, batch-first."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.rotation import Array, from_yaw, yaw_of


@dataclass(frozen=True, slots=True)
class RigidBodyState:
    """Pose and motion of one body, or of many at once.

    A planar robot uses the same state: z, roll and pitch and their rates stay zero.
    """

    position_in_world: Array  # (..., 3) [m]
    quat_xyzw: Array  # (..., 4) attitude of the body in the world [-]
    velocity_in_world: Array  # (..., 3) [m/s]
    angular_velocity_in_body: Array  # (..., 3) [rad/s]

    @property
    def yaw(self) -> Array:
        """Heading, shape (...,) [rad]."""
        return yaw_of(self.quat_xyzw)

    def __getitem__(self, index: Any) -> RigidBodyState:
        """Pick worlds out of a batch."""
        return RigidBodyState(
            self.position_in_world[index],
            self.quat_xyzw[index],
            self.velocity_in_world[index],
            self.angular_velocity_in_body[index],
        )

    def write(self, index: Any, other: RigidBodyState) -> None:
        """Overwrite some worlds of a batch in place, as a reset does."""
        self.position_in_world[index] = other.position_in_world
        self.quat_xyzw[index] = other.quat_xyzw
        self.velocity_in_world[index] = other.velocity_in_world
        self.angular_velocity_in_body[index] = other.angular_velocity_in_body

    def astype(self, dtype: Any) -> RigidBodyState:
        """Copy in another NumPy floating type."""
        return RigidBodyState(
            np.asarray(self.position_in_world, dtype=dtype),
            np.asarray(self.quat_xyzw, dtype=dtype),
            np.asarray(self.velocity_in_world, dtype=dtype),
            np.asarray(self.angular_velocity_in_body, dtype=dtype),
        )


def planar_state(
    x: Array, y: Array, yaw: Array, *, vx: Array = 0.0, vy: Array = 0.0, yaw_rate: Array = 0.0
) -> RigidBodyState:
    """State of a body in the plane z = 0, as NumPy float64.

    Args:
        x: World x, any common shape (...,) [m].
        y: World y [m].
        yaw: Heading [rad].
        vx: World velocity along x [m/s].
        vy: World velocity along y [m/s].
        yaw_rate: Turn rate about z [rad/s].

    Returns:
        State with leading shape (...).
    """
    x, y, yaw, vx, vy, yaw_rate = np.broadcast_arrays(
        *(np.asarray(v, dtype=float) for v in (x, y, yaw, vx, vy, yaw_rate))
    )
    zero = np.zeros_like(x)
    return RigidBodyState(
        np.stack((x, y, zero), axis=-1),
        from_yaw(yaw),
        np.stack((vx, vy, zero), axis=-1),
        np.stack((zero, zero, yaw_rate), axis=-1),
    )


def stack_states(states: list[RigidBodyState]) -> RigidBodyState:
    """Join single states into a batch along a new first axis."""
    return RigidBodyState(
        np.stack([s.position_in_world for s in states]),
        np.stack([s.quat_xyzw for s in states]),
        np.stack([s.velocity_in_world for s in states]),
        np.stack([s.angular_velocity_in_body for s in states]),
    )


@dataclass(frozen=True, slots=True)
class Pose:
    """Where something is or shall be; goals are poses."""

    position_in_world: Array  # (..., 3) [m]
    quat_xyzw: Array  # (..., 4) [-]

    def write(self, index: Any, other: Pose) -> None:
        """Overwrite some worlds of a batch in place."""
        self.position_in_world[index] = other.position_in_world
        self.quat_xyzw[index] = other.quat_xyzw

    def astype(self, dtype: Any) -> Pose:
        """Copy in another NumPy floating type."""
        return Pose(np.asarray(self.position_in_world, dtype=dtype), np.asarray(self.quat_xyzw, dtype=dtype))


def planar_pose(x: Array, y: Array, yaw: Array) -> Pose:
    """Pose in the plane z = 0, as NumPy float64, shapes (...,) [m, m, rad]."""
    state = planar_state(x, y, yaw)
    return Pose(state.position_in_world, state.quat_xyzw)


def stack_poses(poses: list[Pose]) -> Pose:
    """Join single poses into a batch along a new first axis."""
    return Pose(np.stack([p.position_in_world for p in poses]), np.stack([p.quat_xyzw for p in poses]))
