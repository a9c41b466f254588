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
    pull_x, pull_y, twist = _tether(state, world)
    return (
        world.force_x + world.wave_force * across + kick * xp.cos(world.kick_direction) + pull_x,
        world.force_y + world.wave_force * along + kick * xp.sin(world.kick_direction) + pull_y,
        world.torque + world.wave_torque * across + twist,
    )


def push_is_constant(world: World) -> bool:
    """Whether every world is pushed in the same way wherever its body is, at any time; of NumPy arrays."""
    changing = (world.wave_force, world.wave_torque, world.kick, world.tether_stiffness)
    return not any(part.any() for part in changing)


def _tether(state: PlanarState, world: World) -> tuple[Array, Array, Array]:
    """Pull of an air line that hangs from above, as a pendulum's: in proportion to how far its lower end is aside.

    The end is fastened beside the body's origin, so that the moment depends on the heading. The thesis (§3.5.7) says
    that the tether applies "a small torque and force", and no more.
    """
    xp = array_namespace(state.x)
    c, s = xp.cos(state.yaw), xp.sin(state.yaw)
    arm_x, arm_y = c * world.tether_x - s * world.tether_y, s * world.tether_x + c * world.tether_y
    pull_x = world.tether_stiffness * (world.anchor_x - state.x - arm_x)
    pull_y = world.tether_stiffness * (world.anchor_y - state.y - arm_y)
    return pull_x, pull_y, arm_x * pull_y - arm_y * pull_x
