"""The table of dynamics: which robots move, and are disturbed and measured, in which way."""

from __future__ import annotations

from typing import Any

from fulmar_core.dynamics.batch_dynamics import Dynamics, GyrostatDynamics, PlanarDynamics, SpatialDynamics
from fulmar_core.dynamics.flight_dynamics import FlightDynamics
from fulmar_core.robots.robot import Robot
from fulmar_core.states.spatial import SpatialState
from fulmar_core.worlds.scenario import Scenario


def dynamics_of(robot: Robot, scenario: Scenario | None = None) -> Dynamics[Any, Any]:
    """The dynamics of a robot's kind.

    Args:
        robot: The robot.
        scenario: That all worlds are drawn from, which saves the work for what it has not; None: any.
    """
    if robot.flies:
        return FlightDynamics(robot, turbulent=scenario is None or scenario.air.turbulence > 0.0)
    if robot.actuators.turns_only:
        return GyrostatDynamics(robot)
    if robot.state_type is SpatialState:
        return SpatialDynamics(robot, orbits=scenario is None or scenario.orbit_rate > 0.0)
    return PlanarDynamics(robot)
