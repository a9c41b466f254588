"""Force and torque of the surroundings on the body during one control step."""

from __future__ import annotations

from fulmar_core.arrays import array_namespace
from fulmar_core.disturbances.world import World
from fulmar_core.planar import PlanarState
from fulmar_core.rotation import Array


def outside_wrench(
    state: PlanarState, world: World, time_s: Array, control_dt: float
) -> tuple[Array, Array, Array]:
    """What pushes the body from outside; held over a control step, in which a robot moves a few centimetres.

    Args:
        state: Where the body is.
        world: What surrounds it.
        time_s: Time in each episode, shape (...,) [s].
        control_dt: Length of a kick [s].

    Returns:
        Force along the world's x [N] and y [N], and yaw moment [N·m], shapes (...,).
    """
    xp = array_namespace(state.x)
    # F = A sin(k p + phase): RANS `tasks/common_3DoF` and `cfg/task/disturbances/*`.
    across = xp.sin(world.wave_number * state.x + world.wave_phase_x)
    along = xp.sin(world.wave_number * state.y + world.wave_phase_y)
    since = time_s - world.kick_period * xp.floor(time_s / world.kick_period)
    kicking = (since < control_dt) & (time_s >= world.kick_period)
    kick = xp.where(kicking, world.kick, xp.zeros_like(world.kick))
    return (
        world.force_x + world.wave_force * across + kick * xp.cos(world.kick_direction),
        world.force_y + world.wave_force * along + kick * xp.sin(world.kick_direction),
        world.torque + world.wave_torque * across,
    )
