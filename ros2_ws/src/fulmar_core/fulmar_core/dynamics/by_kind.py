"""The tables of dynamics: how robots of each kind move, are disturbed and measured, and what families remember."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.dynamics.actuators.actuation import ActuationState
from fulmar_core.dynamics.actuators.flight_actuation import FlightActuation
from fulmar_core.dynamics.actuators.tank_actuation import TankActuation
from fulmar_core.dynamics.actuators.wheel_actuation import WheelActuation
from fulmar_core.dynamics.batch_dynamics import (
    Dynamics,
    GyrostatDynamics,
    PlanarDynamics,
    RollingDynamics,
    SpatialDynamics,
)
from fulmar_core.dynamics.flight_dynamics import FlightDynamics
from fulmar_core.dynamics.flight_trim import flying_at, in_trim, level_command
from fulmar_core.robots.actuators.families import row_of
from fulmar_core.robots.actuators.family import Actuators
from fulmar_core.robots.robot import Robot
from fulmar_core.states.rotation import Array
from fulmar_core.worlds.scenario import Scenario
from fulmar_core.worlds.world import World

Made = Callable[[Robot, Scenario | None], Dynamics[Any, Any]]


def _in_space(robot: Robot, scenario: Scenario | None) -> Dynamics[Any, Any]:
    return SpatialDynamics(robot, orbits=scenario is None or scenario.orbit_rate > 0.0)


def _aircraft(robot: Robot, scenario: Scenario | None) -> Dynamics[Any, Any]:
    return FlightDynamics(robot, turbulent=scenario is None or scenario.air.turbulence > 0.0)


DYNAMICS: dict[str, Made] = defaultdict(
    lambda: _in_space,
    planar=lambda robot, _: PlanarDynamics(robot),
    rolling=lambda robot, _: RollingDynamics(robot),
    satellite=lambda robot, _: GyrostatDynamics(robot),
    aircraft=_aircraft,
)


def _thrusters(
    actuators: Actuators, safe: Array, *, world: World | None = None, **others: Any
) -> ActuationState:
    """Valves, with a tank where there is one that empties."""
    if world is None or actuators.tank is None:
        return ActuationState(actuators, safe, **others)
    return TankActuation(actuators, safe, world=world, **others)


# By family of actuators, or a base of some, what they remember beside delays, slew and lag.
ACTUATIONS: dict[str, Callable[..., ActuationState]] = {
    "thrusters": _thrusters,
    "reaction_wheels": WheelActuation,
    "control_surfaces": FlightActuation,
}


def _safe_at_rest(robot: Robot, state: Any) -> np.ndarray:
    return np.tile(robot.actuators.safe_command, (len(state.like), 1))


@dataclass(frozen=True)
class Begin:
    """How robots of a kind begin: at rest, in the safe state of their actuators, unless it says otherwise."""

    # A robot, and a pose of 7 numbers: its state there in still air, shapes ().
    at: Callable[[Robot, Array], Any] = lambda robot, pose: robot.state_type.resting(pose)
    # A robot, starts as a task draws them, shapes (n,), and their worlds: starts, and what actuators do, shape (n, m).
    in_world: Callable[[Robot, Any, Any], tuple[Any, np.ndarray]] = lambda robot, start, world: (
        start,
        _safe_at_rest(robot, start),
    )
    # A robot, and measured states, shapes (n,): what actuators do there before anything was commanded, shape (n, m).
    command: Callable[[Robot, Any], np.ndarray] = _safe_at_rest


BEGINS: dict[str, Begin] = defaultdict(Begin, aircraft=Begin(flying_at, in_trim, level_command))


def begin_of(robot: Robot) -> Begin:
    """How a robot begins."""
    return BEGINS[robot.kind.name]


def dynamics_of(robot: Robot, scenario: Scenario | None = None) -> Dynamics[Any, Any]:
    """The dynamics of a robot's kind.

    Args:
        robot: The robot.
        scenario: That all worlds are drawn from, which saves the work for what it has not; None: any.
    """
    return DYNAMICS[robot.kind.name](robot, scenario)


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
    """The actuators of a robot where episodes begin.

    Args:
        robot: The robot.
        safe: What they do then, as in `ActuationState`, shape (n, worlds).
        opens_late: As in `may_open_late`.
        latest_s: As in `longest_delay` [s].
        step_s: Least time between two commands [s].
        changes: Whether a part may stick or the supply may fall within an episode.
        world: Says how full tanks are; None: they never empty, which costs less.
    """
    outlasts_step = latest_s > step_s + 1e-9 and not opens_late
    make = row_of(ACTUATIONS, type(robot.actuators)) or ActuationState
    return make(
        robot.actuators,
        safe,
        opens_late=opens_late,
        delay_ticks=math.ceil(latest_s / robot.timing.physics_dt - 1e-9) if outlasts_step else 0,
        parts=robot.actuators.parts if changes else None,
        world=world,
    )
