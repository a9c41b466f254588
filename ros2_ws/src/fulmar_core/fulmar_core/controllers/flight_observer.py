"""Kalman filter of an aircraft on its own model: what it measures, less the noise.

The prediction is the craft's own dynamics in still air under the commands that were sent; the gain is the steady one of
the linear model at cruise, half a span above the ground (Kwakernaak and Sivan, Linear Optimal Control Systems, 1972,
§6.4).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.controllers.lqr import regulator
from fulmar_core.dynamics.batch_dynamics import Steps
from fulmar_core.dynamics.by_kind import actuation_of
from fulmar_core.dynamics.flight_dynamics import FlightDynamics
from fulmar_core.dynamics.flight_schedule import MOTION, RATE, SPEED, flight_model
from fulmar_core.dynamics.flight_trim import find_trim, still_air
from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import array_namespace
from fulmar_core.states.attitude import (
    euler_of,
    exponential,
    minus,
    normalised,
    plus,
    product,
    rotation_error,
)
from fulmar_core.states.spatial import SpatialState

LEAST = (
    1e-4  # standard deviations of sensors below this count as this: a filter that trusts nothing else [SI]
)


@dataclass(frozen=True)
class ObserverNoise:
    """What the model does not know: white noise of accelerations, as spectral densities."""

    acceleration: float = 0.3  # [m/s² / √Hz]
    turn: float = 0.3  # [rad/s² / √Hz]

    def __post_init__(self) -> None:
        if min(self.acceleration, self.turn) <= 0.0:
            raise ValueError("acceleration and turn must be greater than 0.")


class FlightObserver:
    """The believed state of n craft."""

    def __init__(self, robot: Robot, noise: ObserverNoise, dt: float, *, any_heading: bool = False) -> None:
        """Solve for the gain.

        Args:
            robot: The craft.
            noise: What its model does not know.
            dt: Of a control step [s].
            any_heading: Whether it turns; False: it flies along the world's x.

        Raises:
            ConfigError: The craft has no trim at its speed.
        """
        self._robot, self._dt, self._any_heading = robot, dt, any_heading
        self._dynamics = FlightDynamics(robot, turbulent=False)
        self._substeps = robot.timing.substeps(1.0 / dt)
        model = flight_model(robot, find_trim(robot, robot.wings.speed, 0.5 * robot.wings.span), dt)
        its = robot.sensors.odometry
        spread = np.repeat(
            [max(c.std, LEAST) for c in (its.position, its.heading, its.velocity, its.yaw_rate)], (2, 3, 3, 3)
        )
        push = np.zeros(MOTION)
        push[SPEED], push[RATE] = noise.acceleration**2, noise.turn**2
        a = model.a[:MOTION, :MOTION]
        dual = regulator(a.T, np.eye(MOTION), dt * np.diag(push) + 1e-12 * np.eye(MOTION), np.diag(spread**2))
        # P of the prediction is the cost to go of the dual regulator; the gain corrects after a measurement.
        p = dual.cost_to_go
        self._gain = p @ np.linalg.inv(p + np.diag(spread**2))
        self.reset()

    def reset(self) -> None:
        """Forget the past."""
        self._state: SpatialState | None = None  # of one craft in plain numbers
        self._count = 0

    def update(self, measured: SpatialState, previous: np.ndarray) -> SpatialState:
        """See `StateObserver.update`."""
        count = len(measured.x)
        now = measured.in_numbers() if count == 1 else measured
        if self._state is None or count != self._count:
            self._state, self._count = now, count
            self._world: Any = still_air(self._robot, count)
            self._air = self._world.in_numbers() if count == 1 else self._world
            self._actuation = actuation_of(self._robot, previous.T.copy())
            return measured
        self._actuation.begin(previous.T, self._world, None)
        nothing: Any = 0.0 if count == 1 else np.zeros(count)
        ahead = self._dynamics.move(
            self._state, self._actuation, self._air, (nothing,) * 3, Steps(self._substeps)
        )
        self._state = self._corrected(ahead, now)
        return self._state.in_arrays() if count == 1 else self._state

    def _corrected(self, ahead: SpatialState, measured: SpatialState) -> SpatialState:
        heading = euler_of(ahead.quat)[2] if self._any_heading else 0.0 * ahead.x
        xp = array_namespace(heading)
        c, s = xp.cos(heading), xp.sin(heading)
        away, velocity = (
            (c * v[0] + s * v[1], c * v[1] - s * v[0], v[2])
            for v in (
                minus(measured.position, ahead.position),
                minus(measured.velocity, ahead.velocity),
            )
        )
        turned = rotation_error(ahead.quat, measured.quat)
        off = np.stack((*away[1:], *turned, *velocity, *minus(measured.rate, ahead.rate)))
        step: Any = (self._gain @ off[:, None])[:, 0].tolist() if off.ndim == 1 else self._gain @ off
        # Along x the filter of the other places holds.
        place = float(self._gain[0, 0]) * away[0], step[0], step[1]
        moved, faster = (
            (c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]) for v in (place, (step[5], step[6], step[7]))
        )
        return SpatialState(
            *plus(ahead.position, moved),
            *normalised(product(ahead.quat, exponential((step[2], step[3], step[4])))),
            *plus(ahead.velocity, faster),
            *plus(ahead.rate, (step[8], step[9], step[10])),
        )
