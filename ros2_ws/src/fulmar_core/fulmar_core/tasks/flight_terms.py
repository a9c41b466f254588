"""What tasks of aircraft share: when a craft is lost, its attitude without its heading, and how flights begin."""

from __future__ import annotations

import math

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.attitude import Quaternion, Vector, cross, dot, length, scaled, turn_back
from fulmar_core.states.rotation import Array
from fulmar_core.states.spatial import SpatialState


def is_lost(state: SpatialState, robot: Robot) -> Array:
    """Whether the hull touches the water, or the craft is stalled beyond recovery or nowhere, shape (...,)."""
    xp = array_namespace(state.x)
    stalled = xp.abs(angle_of_attack(state)) > math.radians(robot.wings.lost_deg)
    return (state.z + robot.hull_span[0] <= 0.0) | stalled | ~xp.isfinite(state.z)


def check_above_ground(
    task: str, robot: Robot, lowest: float, leads: str = "starts at", *, otherwise: str = ""
) -> None:
    """Reject a task whose lowest height [m] puts the hull of an aircraft on the ground.

    Raises:
        ConfigError: It does.
    """
    if lowest + robot.hull_span[0] <= 0.0:
        raise ConfigError(
            f"task '{task}' {leads} {lowest:g} m, where the hull of '{robot.name}' touches the ground. Its "
            f"origin is {-robot.hull_span[0]:g} m above its lowest point.{otherwise}"
        )


def angle_of_attack(state: SpatialState) -> Array:
    """Against still air, shape (...,) [rad]."""
    ahead, _, up = state.velocity_in_body
    return array_namespace(ahead).atan2(-up, ahead)


def up_in_body(quat: Quaternion) -> Vector:
    """The world's z axis along the body's axes, which says all of an attitude but the heading."""
    zero = 0.0 * quat[0]
    return turn_back(quat, (zero, zero, 1.0 + zero))


def tilt_error(quat: Quaternion, target: Quaternion) -> Vector:
    """Shortest rotation vector in the body's frame by which an attitude differs from a target, whatever its heading.

    Returns:
        Axis times angle [rad]; a positive x part is a right wing that is too low, a positive y part a nose.
    """
    now, wanted = up_in_body(quat), up_in_body(target)
    axis = cross(now, wanted)
    sine = length(axis)
    xp = array_namespace(sine)
    angle = xp.atan2(sine, dot(now, wanted))
    return scaled(angle / clip(sine, 1e-9, None), axis)
