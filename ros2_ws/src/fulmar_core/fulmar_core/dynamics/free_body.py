"""A planar body that floats on air or water and is pushed about.

Semi-implicit Euler (new velocity, then new position with it), as MuJoCo's Euler integrator. The velocity is kept in the
world, where nothing but forces changes it; the body's own frame would need Coriolis terms that Euler steps inflate.
"""

from __future__ import annotations

from fulmar_core.robots.hydrodynamics import Hydrodynamics
from fulmar_core.states.arrays import array_namespace
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.rotation import Array
from fulmar_core.worlds.world import World

Wrench = tuple[Array, Array, Array]  # forces along two axes [N] and yaw moment [N·m], shapes (...,)


def free_body_step(
    state: PlanarState,
    push: Wrench,
    outside: Wrench,
    world: World,
    water: Hydrodynamics | None,
    dt: float,
) -> PlanarState:
    """Move the centre of mass through one integration step.

    With added mass m_u, m_v and I_r the surge and sway equations (Fossen 2011, eq. 6.109 on the diagonal) read
    (m + m_u) u' = X + (m + m_v) v r and (m + m_v) v' = Y - (m + m_u) u r. In the world's frame their centripetal parts
    of equal mass cancel, and what remains is the difference of the added masses.

    Args:
        state: Of the centre of mass; all arrays of one floating type.
        push: By the actuators, about the centre of mass, in the body's frame.
        outside: By the surroundings, in the world's frame.
        world: Mass, inertia and the factor on the damping.
        water: What the hull swims in; None for a body on air.
        dt: Integration step, > 0 [s].

    Returns:
        State after `dt`.
    """
    xp = array_namespace(state.x)
    c, s = xp.cos(state.yaw), xp.sin(state.yaw)
    ahead, left, moment = push
    mass, yaw_inertia = world.mass, world.yaw_inertia
    if water is not None:
        u, v, r = c * state.vx + s * state.vy, c * state.vy - s * state.vx, state.yaw_rate
        drag = water.planar_damping(u, v, r)
        ahead, left = ahead + world.drag * drag[0], left + world.drag * drag[1]
        moment = moment + world.drag * drag[2]
        mu, mv, ir = water.planar_added_mass
        if mu or ir:
            mass, yaw_inertia = mass + mu, yaw_inertia + ir
        if mv != mu:
            # As if the sway's mass were the surge's, with what that leaves out as forces of their own.
            across = c * outside[1] - s * outside[0]
            left = (left + across + (mv - mu) * u * r) * (mass / (world.mass + mv)) - across
            ahead = ahead + (mv - mu) * v * r
            moment = moment + (mu - mv) * u * v
    ax = (c * ahead - s * left + outside[0]) / mass
    ay = (s * ahead + c * left + outside[1]) / mass
    vx, vy = state.vx + dt * ax, state.vy + dt * ay
    yaw_rate = state.yaw_rate + dt * ((moment + outside[2]) / yaw_inertia)
    return PlanarState(state.x + dt * vx, state.y + dt * vy, state.yaw + dt * yaw_rate, vx, vy, yaw_rate)
