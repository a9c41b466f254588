"""How a robot moves: actuators, dynamics and surroundings of a batch of worlds, joined into one control step."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from fulmar_core.dynamics.actuators.actuation import ActuationState
from fulmar_core.dynamics.actuators.flight_actuation import FlightActuation
from fulmar_core.dynamics.actuators.tank_actuation import TankActuation
from fulmar_core.dynamics.actuators.wheel_actuation import WheelActuation
from fulmar_core.dynamics.free_body import Wrench, free_body_step
from fulmar_core.dynamics.rolling import rolling_step
from fulmar_core.robots.actuators.control_surfaces import ControlSurfaces
from fulmar_core.robots.actuators.pushing import Pushing
from fulmar_core.robots.actuators.reaction_wheels import ReactionWheels
from fulmar_core.robots.actuators.rolling import Rolling
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors import supply, surfaces, wheels
from fulmar_core.states.arrays import array_namespace
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.rotation import Array
from fulmar_core.worlds.scenario import Scenario, longest_opening
from fulmar_core.worlds.world import World, outside_wrench


def actuation_of(
    robot: Robot,
    safe: Array,
    *,
    opens_late: bool = True,
    latest_s: float = 0.0,
    step_s: float = math.inf,
    changes: bool = False,
    world: World | None = None,
) -> ActuationState:
    """The actuators of a robot in their safe state.

    Args:
        robot: The robot.
        safe: Its safe command in every world, shape (n, worlds).
        opens_late: As of `may_open_late`.
        latest_s: As of `longest_delay` [s].
        step_s: Least time between two commands [s].
        changes: Whether a part may stick or the supply may fall within an episode.
        world: Says how full tanks are; None: they never empty, which costs less.
    """
    response = robot.actuators.response
    if isinstance(robot.actuators, Rolling):
        response = dataclasses.replace(response, lag_s=0.0)  # the wheels' own servos bring it in
    outlasts_step = latest_s > step_s + 1e-9 and not opens_late
    delay_ticks = math.ceil(latest_s / robot.timing.physics_dt - 1e-9) if outlasts_step else 0
    parts = robot.actuators.parts if changes else None
    usual: dict[str, Any] = {
        "binary": robot.actuators.binary,
        "scale": robot.actuators.scale,
        "safe": safe,
        "opens_late": opens_late,
        "delay_ticks": delay_ticks,
        "parts": parts,
    }
    if isinstance(robot.actuators, ControlSurfaces):
        return FlightActuation(robot.actuators, safe, delay_ticks=delay_ticks, parts=parts)
    if isinstance(robot.actuators, ReactionWheels):
        return WheelActuation(response, count=robot.actuators.count, **usual)
    if world is not None and robot.actuators.tank is not None:
        return TankActuation(robot.actuators, robot.actuators.tank, world, response, **usual)
    return ActuationState(response, **usual)


def truths_of(robot: Robot, actuation: ActuationState) -> dict[str, Any]:
    """What sensors measure of the actuators of a batch of one, by the names of the sensors; see `Truth.more`."""
    if isinstance(actuation, WheelActuation):
        assert isinstance(robot.actuators, ReactionWheels)  # as in `actuation_of`
        speeds = np.asarray(actuation.speeds[:, 0], dtype=float)
        return {wheels.NAME: wheels.WheelSpeeds(robot.actuators.wheel_names, speeds)}
    if isinstance(actuation, FlightActuation):
        positions = np.asarray(actuation.applied[:, 0], dtype=float)
        return {surfaces.NAME: surfaces.SurfacePositions(robot.actuators.names, positions)}
    if isinstance(actuation, TankActuation):
        return {supply.NAME: float(actuation.pressure[0])}
    return {}


def may_open_late(robot: Robot, scenario: Scenario) -> bool:
    """Whether closed valves open later than open ones close in any world."""
    return longest_opening(robot, scenario) > 0.0


def may_be_off_centre(robot: Robot, scenario: Scenario) -> bool:
    """Whether the centre of mass is beside the body's origin in any world."""
    uncertain = scenario.body == "uncertain" and robot.uncertainty.center_of_mass > 0.0
    return uncertain or any(robot.body.center_of_mass)


def control_step(
    robot: Robot,
    state: PlanarState,
    actuation: ActuationState,
    world: World,
    *,
    time_s: Array,
    substeps: int,
    latest_s: float,
    off_centre: bool,
) -> PlanarState:
    """Move through one control step; the actuators have their command already.

    Args:
        robot: The robot.
        state: Of the body's origin, shapes (worlds,).
        actuation: What the actuators do.
        world: Bodies and surroundings.
        time_s: Time in each episode [s].
        substeps: Integration steps.
        latest_s: As of `longest_delay` [s].
        off_centre: As of `may_be_off_centre`.

    Returns:
        State after `substeps` physics steps.
    """
    outside = outside_wrench(state, world, time_s, substeps * robot.timing.physics_dt)
    return move(
        robot, state, actuation, world, outside, substeps=substeps, latest_s=latest_s, off_centre=off_centre
    )


def move(
    robot: Robot,
    state: PlanarState,
    actuation: ActuationState,
    world: World,
    outside: Wrench,
    *,
    substeps: int,
    latest_s: float,
    off_centre: bool,
) -> PlanarState:
    """Move under a push that stays the same; arguments as in `control_step`."""
    dt, actuators = robot.timing.physics_dt, robot.actuators
    if isinstance(actuators, Rolling):
        for _ in range(substeps):
            target = actuation.advance(dt, latest_s=latest_s)
            state = rolling_step(state, target, actuation.gain, outside, world, actuators, dt)
        return state
    assert isinstance(actuators, Pushing)  # what does not roll is pushed
    if off_centre:
        state = to_center(state, world)
    push: Wrench | None = None
    doing: Array = None
    for _ in range(substeps):
        applied = actuation.advance(dt, latest_s=latest_s)
        if push is None or applied is not doing:
            doing = applied
            push = actuators.planar_wrench(applied, actuation.gain)
            if off_centre:
                ahead, left, moment = push
                push = ahead, left, moment - (world.com_x * left - world.com_y * ahead)
        state = free_body_step(state, push, outside, world, robot.hydrodynamics, dt)
    return to_center(state, world, -1.0) if off_centre else state


def to_center(state: PlanarState, world: World, sign: float = 1.0) -> PlanarState:
    """State of the centre of mass from that of the origin (+1), or back (-1)."""
    xp = array_namespace(state.x)
    c, s = xp.cos(state.yaw), xp.sin(state.yaw)
    dx = sign * (c * world.com_x - s * world.com_y)
    dy = sign * (s * world.com_x + c * world.com_y)
    r = state.yaw_rate
    return PlanarState(state.x + dx, state.y + dy, state.yaw, state.vx - r * dy, state.vy + r * dx, r)
