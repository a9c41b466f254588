"""What the motion of a robot depends on: late valves, where its centre of mass is, and what it blows out."""

from __future__ import annotations

from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import array_namespace
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.rotation import Array
from fulmar_core.worlds.scenario import Scenario, longest_opening
from fulmar_core.worlds.world import World


def may_open_late(robot: Robot, scenario: Scenario) -> bool:
    """Whether closed valves open later than open ones close in any world."""
    return longest_opening(robot, scenario) > 0.0


def may_be_off_centre(robot: Robot, scenario: Scenario) -> bool:
    """Whether the centre of mass is beside the body's origin in any world."""
    uncertain = scenario.body == "uncertain" and robot.uncertainty.center_of_mass > 0.0
    return uncertain or any(robot.body.center_of_mass)


def tank_empties(robot: Robot, scenario: Scenario) -> bool:
    """Whether what is blown out counts in a batch: by weight, or since a tank is not full when episodes begin."""
    tank = robot.actuators.tank
    return tank is not None and (tank.weighs or scenario.actuation.supply.tank < 1.0)


def to_center(state: PlanarState, world: World, sign: float = 1.0) -> PlanarState:
    """State of the centre of mass from that of the origin (+1), or back (-1)."""
    xp = array_namespace(state.x)
    c, s = xp.cos(state.yaw), xp.sin(state.yaw)
    dx = sign * (c * world.com_x - s * world.com_y)
    dy = sign * (s * world.com_x + c * world.com_y)
    r = state.yaw_rate
    return PlanarState(state.x + dx, state.y + dy, state.yaw, state.vx - r * dy, state.vy + r * dx, r)


def left_of(mass: Array, lost_before: Array, lost: Array) -> tuple[Array, Array]:
    """What a body keeps of its mass and inertia while it blows some of itself out.

    What leaves takes its own momentum along and comes from the centre of mass, so that the body's turn rate stays; jets
    that turn with the body and slow it down are left out (RANS and SRB scale the inertia alike).

    Args:
        mass: Of the whole body, shape (worlds,) [kg].
        lost_before: When an integration step begins, same shape [kg].
        lost: When it ends.

    Returns:
        The share in the middle of the step, which makes it one of second order [-]; and `lost`.
    """
    return 1.0 - 0.5 * (lost_before + lost) / mass, lost
