"""Many flights of a craft into the future, on the core's own dynamics in still air, and what they cost."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fulmar_core.controllers.flight_lqi import FlightLqr
from fulmar_core.controllers.flight_reference import Aim
from fulmar_core.dynamics.actuators.flight_actuation import FlightActuation
from fulmar_core.dynamics.batch_dynamics import Steps
from fulmar_core.dynamics.flight_dynamics import FlightDynamics
from fulmar_core.dynamics.flight_trim import still_air
from fulmar_core.robots.actuators.control_surfaces import ControlSurfaces
from fulmar_core.robots.robot import Robot
from fulmar_core.states.attitude import length
from fulmar_core.states.rotation import Array
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks.flight_terms import angle_of_attack

WORST = 1e12  # of a second of a flight that is no number [-]


@dataclass(frozen=True)
class FlightCost:
    """What a second of flight costs; FALCON-S has a hundredth of these numbers for each step of 10 ms."""

    height: float = 400.0  # per m away from the reference
    side: float = 1000.0  # per m
    turning: float = 300.0  # per rad/s of the three turn rates together
    speed: float = 450.0  # per m/s away from the cruising speed
    sideslip: float = 5.0  # times e^(2 |sideslip in degrees|) - 1, of 10° at most
    lost: float = 1e9  # in the water, or at an angle of attack beyond `alpha_deg`
    alpha_deg: float | None = None  # either way; None: beyond those of `loss_angles` [deg]

    def __post_init__(self) -> None:
        if min(self.height, self.side, self.turning, self.speed, self.sideslip, self.lost) < 0.0:
            raise ValueError("costs must not be negative.")
        if self.alpha_deg is not None and self.alpha_deg <= 0.0:
            raise ValueError(f"alpha_deg = {self.alpha_deg:g} must be greater than 0.")


class FlightRollouts:
    """Flights of some craft side by side; those of one craft begin alike and differ by their corrections."""

    def __init__(
        self, robot: Robot, law: FlightLqr, cost: FlightCost, *, step_s: float, share: float
    ) -> None:
        """Prepare.

        Args:
            robot: An aircraft.
            law: That flights follow.
            cost: What they are measured by.
            step_s: Time step [s].
            share: Of the law's answer to departures that they follow; 0: commands of level flight alone [-].
        """
        timing = replace(robot.timing, physics_dt=step_s, control_hz=1.0 / step_s)
        self._robot = replace(robot, timing=timing)
        self._dynamics = FlightDynamics(self._robot, turbulent=False)
        self._law, self._cost, self._dt, self._share = law, cost, step_s, share
        self._speed, self._lowest = robot.wings.speed, -robot.hull_span[0]
        most = cost.alpha_deg
        self._alphas_deg = loss_angles(robot) if most is None else (-most, most)
        self._world: Any = still_air(self._robot, 1)

    def fly(
        self, state: SpatialState, servos: np.ndarray, aims: Sequence[Aim], corrections: np.ndarray
    ) -> np.ndarray:
        """Cost of every flight.

        Args:
            state: Of n craft, shapes (n,).
            servos: As in `FlightLqi.servos_after`, shape (n, ...).
            aims: At the beginning and after each step.
            corrections: Added to the commands of each step, shape (steps, n, flights, m).

        Returns:
            Shape (n, flights).
        """
        steps, count, each, commands = corrections.shape
        total = count * each
        if len(self._world.mass) != total:
            self._world = still_air(self._robot, total)
        state = state.mapped(lambda part: np.repeat(part, each))
        craft = self._robot.actuated_by(ControlSurfaces)
        actuation = FlightActuation(craft, np.repeat(servos[:, :commands].T, each, axis=1))
        actuation.servo_rates = np.repeat(servos[:, commands:].T, each, axis=1)
        still, cost = (np.zeros(total),) * 3, np.zeros(total)
        for step in range(steps):
            now = np.concatenate((actuation.applied, actuation.servo_rates)).T
            wanted = self._followed(state, aims[step], now) + corrections[step].reshape(total, commands)
            actuation.begin(np.asarray(self._robot.actuators.limited(wanted)).T.copy(), self._world, None)
            state = self._dynamics.move(state, actuation, self._world, still, Steps(1))
            cost += self._dt * self._per_second(state, np.repeat(aims[step + 1].place, each, axis=0))
        return cost.reshape(count, each)

    def _followed(self, states: SpatialState, aim: Aim, servos: np.ndarray) -> np.ndarray:
        if self._share == 0.0:
            level = self._law.level(self._law.schedule, aim)
            return np.repeat(level, len(states.x) // len(level), axis=0)
        return self._law.answers(states, aim, servos, share=self._share)

    def _per_second(self, state: SpatialState, place: np.ndarray) -> np.ndarray:
        """Cost of a second in a state, shape (total,)."""
        c = self._cost
        ahead, left, up = state.velocity_in_body
        speed = length(state.velocity)
        alpha = np.degrees(angle_of_attack(state))
        slip = np.degrees(np.abs(np.arctan2(left, np.hypot(ahead, up))))
        cost = c.height * np.abs(state.z - place[:, 1]) + c.side * np.abs(state.y - place[:, 0])
        cost += c.turning * _sum_of_sizes(state.rate) + c.speed * np.abs(speed - self._speed)
        cost += c.sideslip * np.expm1(np.minimum(2.0 * slip, 20.0))
        # The dynamics stop a craft in the water where it was before it touched it.
        low, high = self._alphas_deg
        lost = (state.z <= self._lowest) | (speed == 0.0) | (alpha < low) | (alpha > high)
        return np.where(np.isfinite(cost), cost + c.lost * lost, WORST)


def _sum_of_sizes(parts: tuple[Array, ...]) -> np.ndarray:
    return np.asarray(sum(np.abs(part) for part in parts))


def loss_angles(robot: Robot) -> tuple[float, float]:
    """Smallest and largest angle of attack that flights stay between [deg].

    They are the ends of what the coefficients are for, where these lie within most of the stall angle either way.
    """
    coefficients, stall = robot.wings.aerodynamics, 0.75 * robot.wings.stall_deg
    if coefficients.alpha_range is None:
        return -stall, stall
    low, high = (end if coefficients.unit == "deg" else math.degrees(end) for end in coefficients.alpha_range)
    return max(low, -stall), min(high, stall)
