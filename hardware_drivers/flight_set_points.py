"""Attitude, turn rates and thrust that make an autopilot fly as surfaces and throttles would.

A controller of an aircraft commands deflections and throttles; an autopilot takes an attitude or turn rates, and moves
the surfaces itself. The robot's own model says where the commanded deflections would have turned the craft a short time
ahead, and that is what the autopilot is asked for: the craft then flies as the model that the controller knows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fulmar_core.dynamics.actuators.flight_actuation import FlightActuation
from fulmar_core.dynamics.batch_dynamics import Steps
from fulmar_core.dynamics.flight_dynamics import FlightDynamics
from fulmar_core.dynamics.flight_trim import still_air
from fulmar_core.robots.actuators.control_surfaces import ControlSurfaces
from fulmar_core.robots.robot import Robot
from fulmar_core.states.spatial import SpatialState
from fulmar_core.states.state import RigidBodyState

STEP_S = 0.05  # our value: of the prediction, a fourth-order step; damping in roll is not faster
STILL = (0.0, 0.0, 0.0)  # nothing pushes [N]


@dataclass(frozen=True)
class SetPoint:
    """What an autopilot is asked for."""

    quat_xyzw: np.ndarray  # (4,) attitude of the body (ahead, left, up) in the world (east, north, up)
    rates: np.ndarray  # (3,) about ahead, left and up [rad/s]
    thrust: float  # mean of the throttles, 0 to 1


class FlightSetPoints:
    """Predicts flights of one craft in still air."""

    def __init__(self, robot: Robot, lead_s: float) -> None:
        """Look so far ahead, > 0 [s]."""
        self._count = max(1, math.ceil(lead_s / STEP_S))
        step_s = lead_s / self._count
        fine = replace(robot, timing=replace(robot.timing, physics_dt=step_s, control_hz=1.0 / step_s))
        self._craft = robot.actuated_by(ControlSurfaces)
        self._dynamics = FlightDynamics(fine, turbulent=False)
        self._world: Any = still_air(fine, 1)
        self._numbers = self._world.in_numbers()
        # One for all predictions: it keeps what it has computed for its time step.
        self._actuation = FlightActuation(self._craft, robot.actuators.safe_command[:, None])

    def of(self, state: RigidBodyState, command: np.ndarray) -> SetPoint:
        """What a command asks for in a measured state.

        Args:
            state: Newest measured motion.
            command: Deflections [rad] and throttles, within the limits, shape (n,).

        Returns:
            Of the model that flies on with this command, its servos where it asks for.
        """
        values = np.asarray(command, dtype=float)[:, None]
        self._actuation.hold(values)
        self._actuation.begin(values, self._world, None)
        begun = SpatialState.from_rigid(state)[None].in_float64().in_numbers()
        moved = self._dynamics.move(begun, self._actuation, self._numbers, STILL, Steps(self._count))
        ahead = moved.to_rigid()
        thrust = float(np.mean(values[self._craft.positions :])) if self._craft.motors else 0.0
        return SetPoint(
            np.asarray(ahead.quat_xyzw, dtype=float),
            np.asarray(ahead.angular_velocity_in_body, dtype=float),
            min(1.0, max(0.0, thrust)),
        )
