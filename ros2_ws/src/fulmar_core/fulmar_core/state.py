"""The rigid-body state that wires and simulators speak: 6-DoF, batch-first."""

from __future__ import annotations

from dataclasses import dataclass

from fulmar_core.rotation import Array, yaw_of


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
