"""Gas that a robot in space keeps for stopping, by the gauge of its tank.

A kilogram of gas is worth g times the specific impulse of the nozzles (Sutton and Biblarz, Rocket Propulsion Elements,
9th ed., eq. 2-5), whatever the thrust. To stop takes the momentum m·v and the angular momentum of the body, each times
what the valves spend for an impulse of that kind, since nozzles that point askew push against each other. Only gas
above the pressure of the regulator counts: below it thrust falls, and with it the distance in which the robot stops.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fulmar_core.controllers.allocation import Allocation
from fulmar_core.controllers.controller import Inputs
from fulmar_core.robots.actuators.pushing import Pushing
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.fuel import NAME as FUEL
from fulmar_core.robots.sensors.supply import NAME as SUPPLY
from fulmar_core.states.arrays import side_by_side
from fulmar_core.states.attitude import even_directions
from fulmar_core.states.rotation import cross

AGED_S = 1.0  # readings of a gauge are taken for so long, see `ReadingKind.lasts_s`
SPREAD = 3.0  # standard deviations of the gauge that count as gone
SHARE = 0.6  # of the gas that stopping counts on: valves may be dead, and noise makes them open
HOLDS_M_S = 0.1  # change of speed that is kept beside: a robot at rest is once sent away from a thing
DIRECTIONS = 200  # in which impulses are tried for the dearest


def gauges_of(robot: Robot) -> tuple[str, ...]:
    """Name of the reading that says what is left in the tank; none of a robot without a tank or without a gauge."""
    if robot.actuators.tank is None:
        return ()
    return next(((name,) for name in (FUEL, SUPPLY) if name in robot.sensors.specs), ())


class FuelReserve:
    """Knows which robots of one kind have no more gas than stopping takes.

    Attributes:
        spent: Which of them these are since the last `reset`, shape (n,).
    """

    def __init__(
        self, robot: Robot, allocation: Allocation, force: float, torque: float, late_s: float
    ) -> None:
        """Find out what stopping costs.

        Args:
            robot: It pushes, and has a tank with a gauge.
            allocation: Of the wrenches that stop it, shape (6,) [N, N·m].
            force: With which it brakes [N].
            torque: With which it steadies itself [N·m].
            late_s: So long it speeds up before it brakes [s].
        """
        actuators, tank = robot.actuated_by(Pushing), robot.actuators.tank
        assert tank is not None, "no gauge without a tank"
        (self._gauge,) = gauges_of(robot)
        self._actuators, self._tank, self._body = actuators, tank, robot.body
        std = float(robot.sensors.specs[self._gauge].std)
        unsure = std if self._gauge == FUEL else float(tank.left(std))
        flow = float(actuators.total_thrust(actuators.scale))
        self._unsure = SPREAD * tank.exhaust_speed * unsure + flow * AGED_S
        com = np.array(robot.body.com)
        self._by_force = _price(actuators, allocation, com, np.array([force, 0.0]))
        self._by_torque = _price(actuators, allocation, com, np.array([0.0, torque]))
        faster = force / robot.body.mass * late_s
        self._least = robot.body.mass * (faster + HOLDS_M_S) * self._by_force
        self._left: np.ndarray | None = None  # impulse of what is in the tanks for certain [N·s]
        self.reset()

    def reset(self) -> None:
        """Let every robot spend gas again that has more than stopping takes: a new goal or episode, or a jump."""
        self._counted_ns = -1
        self.spent = np.zeros(1, dtype=bool)

    @property
    def left(self) -> np.ndarray | None:
        """Impulse that is left for certain, shape (n,) [N·s]; None before the gauge has said anything."""
        return self._left

    def needed(self, state: Any) -> np.ndarray:
        """Impulse that stopping takes, and one sending away, shape (n,) [N·s].

        Args:
            state: Of bodies in space, as measured, shapes (n,).
        """
        speed = np.linalg.norm(_rows(state.velocity), axis=-1)
        spin = np.linalg.norm(_rows(state.rate) @ self._body.inertia_matrix, axis=-1)
        moving = self._body.mass * speed * self._by_force + spin * self._by_torque
        return np.asarray((moving + self._least) / SHARE)

    def watch(self, inputs: Inputs) -> np.ndarray:
        """Which robots may spend gas on nothing but stopping from now on, shape (n,), until `reset`.

        Args:
            inputs: Of a control step; the commands before it are taken for spent where no gauge speaks.
        """
        if inputs.stamp_ns != self._counted_ns:
            self._counted_ns = inputs.stamp_ns
            self._count(inputs)
        if self._left is None:
            self.spent = np.zeros(len(inputs.previous), dtype=bool)
        else:
            already = self.spent if len(self.spent) == len(self._left) else False
            self.spent = already | (self._left < self.needed(inputs.state))
        return self.spent

    def _count(self, inputs: Inputs) -> None:
        """Take the newest reading, or take what was commanded from the one before."""
        reading, tank = inputs.readings.get(self._gauge), self._tank
        if reading is not None:
            values = np.asarray(reading, dtype=float)[:, 0]
            mass = values if self._gauge == FUEL else tank.left(values)
            self._left = tank.exhaust_speed * (mass - tank.left(tank.regulated)) - self._unsure
        elif self._left is not None:
            thrust = np.asarray(self._actuators.total_thrust(inputs.previous.T))
            self._left = self._left - inputs.dt * (thrust + tank.exhaust_speed * tank.leak)


def _price(actuators: Pushing, allocation: Allocation, com: np.ndarray, sizes: np.ndarray) -> float:
    """Impulse of all nozzles for one of the body, along the dearest direction.

    Args:
        actuators: Of the robot.
        allocation: See `FuelReserve`.
        com: Centre of mass, shape (3,) [m].
        sizes: Force [N] and torque [N·m], of which one is 0, shape (2,).

    Returns:
        [N per N], or [N per N·m].
    """
    ways = even_directions(DIRECTIONS)
    force, torque = sizes[0] * ways, sizes[1] * ways
    commands = allocation.best(np.concatenate((force, torque + cross(com, force)), axis=1))
    made = actuators.wrench_in_body(commands)
    made_along = np.sum((made[0] if sizes[0] else made[1]) * ways, axis=1)
    return float(np.max(actuators.total_thrust(commands.T) / np.maximum(made_along, 0.1 * sizes.max())))


def _rows(parts: Sequence[np.ndarray]) -> np.ndarray:
    return np.asarray(side_by_side(*parts))
