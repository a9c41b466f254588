"""Motion in space: what free flyers, their tasks and their controllers compute with in a batch.

The component axis comes first, so that thousands of worlds lie side by side in memory.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

from fulmar_core.arrays import array_namespace
from fulmar_core.attitude import turn_back
from fulmar_core.rotation import Array
from fulmar_core.state import RigidBodyState


@dataclass(frozen=True, slots=True)
class SpatialState:
    """Pose and motion of one rigid body in space, or of many: thirteen numbers each."""

    position: Array  # (3, ...) in the world [m]
    quat_xyzw: Array  # (4, ...) attitude of the body in the world, of length 1 [-]
    velocity: Array  # (3, ...) along the world's axes [m/s]
    turn_rate: Array  # (3, ...) about the body's axes [rad/s]

    def __getitem__(self, index: Any) -> SpatialState:
        """Pick worlds out of a batch."""
        return SpatialState(*(getattr(self, name)[:, index] for name in PARTS))

    def write(self, index: Any, other: SpatialState) -> None:
        """Overwrite some worlds of a batch in place, as a reset does."""
        for name in PARTS:
            getattr(self, name)[:, index] = getattr(other, name)

    @property
    def velocity_in_body(self) -> Array:
        """Velocity along the body's axes, shape (3, ...) [m/s]."""
        return turn_back(self.quat_xyzw, self.velocity)


PARTS = tuple(f.name for f in fields(SpatialState))


def at_rest_in_space(position: Array, quat_xyzw: Array) -> SpatialState:
    """A body that stands still at a pose, shapes (3, ...) and (4, ...) [m, -]."""
    zeros = array_namespace(position).zeros_like
    return SpatialState(position, quat_xyzw, zeros(position), zeros(position))


def spatial_of(state: RigidBodyState) -> SpatialState:
    """The batch's form of a rigid-body state: component axis first."""
    return SpatialState(
        *(
            array_namespace(part).moveaxis(part, -1, 0)
            for part in (
                state.position_in_world,
                state.quat_xyzw,
                state.velocity_in_world,
                state.angular_velocity_in_body,
            )
        )
    )


def rigid_of_spatial(state: SpatialState) -> RigidBodyState:
    """The rigid-body state of a batch's: component axis last."""
    xp = array_namespace(state.position)
    return RigidBodyState(*(xp.moveaxis(getattr(state, name), 0, -1) for name in PARTS))
