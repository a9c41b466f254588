"""Safe controller of aircraft: a wing cannot stop, so it flies on with level wings, holds its height, then descends."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from fulmar_core.actuators.refuge import Refuge
from fulmar_core.attitude import euler_of, from_euler, product
from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.flight_lqi import FlightLqr, flight_lqr_weights
from fulmar_core.goal import goals_at
from fulmar_core.robot import Robot
from fulmar_core.spatial import SpatialState
from fulmar_core.state import RigidBodyState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.follow_reference import NOW

HOLD_S = 5.0  # for which the height is held: a controller that comes back within it finds the craft where it was [s]
SINK = 0.4  # of the descent [m/s]
NEAREST = (
    0.2  # heights of the descent end here below the lowest part of the hull, so that it touches down [m]
)


class LevelDescent:
    """See `Refuge`. Without a measured state surfaces are neutral and throttles idle: nothing else is safe then."""

    longest_s = math.inf

    def __init__(self, robot: Robot) -> None:
        """Solve for its gains; `robot` is an aircraft.

        Raises:
            ConfigError: It has no trim at its speed.
        """
        self._robot = robot
        weights = replace(flight_lqr_weights(robot), side=1e-3, observer=None)
        self._law = FlightLqr(robot, load_task("fly_hold").fitted(robot), weights)
        self._since_s = math.inf

    def command(self, since_s: float, last: np.ndarray, state: RigidBodyState | None) -> np.ndarray:
        """See `Refuge.command`; a time before that of the call before begins anew."""
        if state is None:
            return self._robot.actuators.safe_command
        now = SpatialState.from_rigid(state)[None].in_float64()
        if since_s < self._since_s:
            self._height, self._heading = float(now.z[0]), float(euler_of(now.quat)[2][0])
            self._law.reset()
            self._sent = np.asarray(last, dtype=float)
        self._since_s = since_s
        ahead = self._along(now)
        sinking = max(0.0, since_s - HOLD_S)
        lowest = -self._robot.hull_span[0] - NEAREST
        height = max(self._height - SINK * sinking, lowest)
        falls = SINK if sinking and height > lowest else 0.0
        self._sent = self._answer(ahead, height, falls)
        return self._sent

    def _along(self, state: SpatialState) -> SpatialState:
        """The state in a world whose x axis is the heading at the beginning."""
        c, s = math.cos(self._heading), math.sin(self._heading)
        zero = np.zeros(1)
        back = from_euler(zero, zero, zero - self._heading)

        def turned(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            return c * x + s * y, c * y - s * x

        return SpatialState(
            *turned(state.x, state.y),
            state.z,
            *product(back, state.quat),
            *turned(state.vx, state.vy),
            state.vz,
            *state.rate,
        )

    def _answer(self, state: SpatialState, height: float, falls: float) -> np.ndarray:
        target = np.zeros((1, 7))
        target[0, 1], target[0, 2], target[0, 6] = state.y[0], height, 1.0
        goal = goals_at(target)
        now = np.array([[0.0, 0.0, state.y[0], height, 0.0, 0.0, -falls]])
        dt = 1.0 / self._law.control_hz
        empty = np.zeros((1, 0))
        inputs = Inputs(state, replace(goal, things={NOW: now}), empty, self._sent[None], None, 0, dt)
        return np.asarray(self._robot.actuators.limited(self._law.command(inputs))[0])


def refuge_of(robot: Robot) -> Refuge:
    """Safe controller of a robot: that of its actuators, or, of an aircraft, one that flies."""
    return LevelDescent(robot) if robot.flies else robot.actuators.refuge
