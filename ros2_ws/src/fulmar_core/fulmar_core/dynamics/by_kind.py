"""The table of dynamics: which robots move, and are disturbed and measured, in which way."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from fulmar_core.dynamics.batch_dynamics import Dynamics, GyrostatDynamics, PlanarDynamics, SpatialDynamics
from fulmar_core.dynamics.flight_dynamics import FlightDynamics
from fulmar_core.robots.robot import Robot
from fulmar_core.worlds.scenario import Scenario

Made = Callable[[Robot, Scenario | None], Dynamics[Any, Any]]


def _planar(robot: Robot, _scenario: Scenario | None) -> Dynamics[Any, Any]:
    return PlanarDynamics(robot)


def _free_flyer(robot: Robot, scenario: Scenario | None) -> Dynamics[Any, Any]:
    return SpatialDynamics(robot, orbits=scenario is None or scenario.orbit_rate > 0.0)


def _satellite(robot: Robot, _scenario: Scenario | None) -> Dynamics[Any, Any]:
    return GyrostatDynamics(robot)


def _aircraft(robot: Robot, scenario: Scenario | None) -> Dynamics[Any, Any]:
    return FlightDynamics(robot, turbulent=scenario is None or scenario.air.turbulence > 0.0)


DYNAMICS: dict[str, Made] = {
    "planar": _planar,
    "rolling": _planar,
    "free_flyer": _free_flyer,
    "satellite": _satellite,
    "aircraft": _aircraft,
}


def dynamics_of(robot: Robot, scenario: Scenario | None = None) -> Dynamics[Any, Any]:
    """The dynamics of a robot's kind.

    Args:
        robot: The robot.
        scenario: That all worlds are drawn from, which saves the work for what it has not; None: any.
    """
    return DYNAMICS[robot.kind.name](robot, scenario)
