"""A planar body on wheels that do not slip sideways: it goes where it points.

The wheels are driven by speed servos: the speed follows its target with the drive's lag, as fast as motors and friction
allow. A push from outside only counts along the way the wheels roll, and only where it is more than the motors hold.
"""

from __future__ import annotations

from fulmar_core.dynamics.free_body import Wrench
from fulmar_core.robots.actuators.rolling import Rolling
from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.rotation import Array
from fulmar_core.worlds.world import World


def rolling_step(
    state: PlanarState,
    target: Array,
    gain: Array,
    outside: Wrench,
    world: World,
    drive: Rolling,
    dt: float,
) -> PlanarState:
    """Move the body through one integration step.

    Args:
        state: Of the point between the driven wheels.
        target: What the servos are asked for, shape (2, ...): speed [m/s], and turn rate [rad/s] or steering [rad].
        gain: Factor on the speeds (worn tyres), shape (2, ...).
        outside: Push from the surroundings, in the world's frame.
        world: Mass and inertia.
        drive: The wheels.
        dt: Integration step, > 0 [s].

    Returns:
        State after `dt`.
    """
    xp = array_namespace(state.x)
    c, s = xp.cos(state.yaw), xp.sin(state.yaw)
    speed = c * state.vx + s * state.vy
    wanted = target[0] * gain[0]
    most = drive.pull / world.mass
    along = (c * outside[0] + s * outside[1]) / world.mass
    speed = speed + dt * clip((wanted - speed) / drive.servo_s, along - most, along + most)
    yaw_rate = drive.next_yaw_rate(state, speed, target[1] * gain[1], outside[2], world.yaw_inertia, dt)
    yaw = state.yaw + dt * yaw_rate
    c, s = xp.cos(yaw), xp.sin(yaw)
    vx, vy = speed * c, speed * s
    return PlanarState(state.x + dt * vx, state.y + dt * vy, yaw, vx, vy, yaw_rate)
