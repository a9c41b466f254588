"""A planar body on wheels that do not slip sideways: it goes where it points.

The wheels are driven by speed servos: the speed follows its target with the drive's lag, as fast as motors and friction
allow. A push from outside only counts along the way the wheels roll, and only where it is more than the motors hold.
"""

from __future__ import annotations

from fulmar_core.actuators.ackermann import Ackermann
from fulmar_core.actuators.differential_drive import DifferentialDrive
from fulmar_core.arrays import array_namespace, clip
from fulmar_core.disturbances.world import World
from fulmar_core.dynamics.free_body import Wrench
from fulmar_core.dynamics.hydrodynamics import GRAVITY
from fulmar_core.planar import PlanarState
from fulmar_core.rotation import Array

SERVO_S = 0.05  # time constant of a wheel's speed servo where the drive names none [s]


def rolling_step(
    state: PlanarState,
    target: Array,
    gain: Array,
    outside: Wrench,
    world: World,
    drive: DifferentialDrive | Ackermann,
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
    lag = max(drive.response.lag_s, SERVO_S)
    c, s = xp.cos(state.yaw), xp.sin(state.yaw)
    speed = c * state.vx + s * state.vy
    wanted = target[0] * gain[0]
    wheels = 2.0 if isinstance(drive, DifferentialDrive) else 1.0
    most = wheels * drive.wheel_force / world.mass
    along = (c * outside[0] + s * outside[1]) / world.mass
    speed = speed + dt * clip((wanted - speed) / lag, along - most, along + most)
    if isinstance(drive, DifferentialDrive):
        fastest = drive.wheel_force * drive.track / world.yaw_inertia
        twist = outside[2] / world.yaw_inertia
        turning = clip((target[1] * gain[1] - state.yaw_rate) / lag, twist - fastest, twist + fastest)
        yaw_rate = state.yaw_rate + dt * turning
    else:
        # Bicycle model (Rajamani, "Vehicle Dynamics and Control", 2012, §2.2), rear axle as reference.
        # Tyres push sideways with friction at most; beyond it the car goes wider than it steers.
        widest = drive.friction * GRAVITY / clip(xp.abs(speed), 1e-3, None)
        yaw_rate = clip(speed * xp.tan(target[1] * gain[1]) / drive.wheelbase, -widest, widest)
    yaw = state.yaw + dt * yaw_rate
    c, s = xp.cos(yaw), xp.sin(yaw)
    vx, vy = speed * c, speed * s
    return PlanarState(state.x + dt * vx, state.y + dt * vy, yaw, vx, vy, yaw_rate)
