"""Choice of valves for the wrench that a network asks for.

A network that decides about each valve by itself has to find out which of them go together, since n open valves on one
pressure line give 1/n each; and while it explores, every wrong opening is a kick. One that asks for a wrench explores
smoothly, and what is smaller than the least useful combination opens nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fulmar_core.controllers.valve_allocation import ValveAllocation
from fulmar_core.robots.actuators.thrusters import Thrusters
from fulmar_core.robots.robot import Robot
from fulmar_core.states.arrays import array_namespace
from fulmar_core.states.rotation import Array

WRENCH = 3  # force ahead, to the left, and torque
FULL_SHARE = 1.5  # what a share of 1 asks for, in units: beyond one of them only the direction matters [-]
# Of missing all torque, where missing all force weighs 1: about as in the tuned LQR's cost-to-go.
TORQUE_WEIGHT = 4.4
VALVE_COST = 0.045  # of an open valve, where missing all force costs 1; what is not worth a valve opens none
HASTE_COST = 2.5  # factor on that for each unit² asked for: who asks for much cares less how exactly it comes
DEAD_COST = 100.0  # of opening a dead valve; more than any wrench is worth
ORDER_COST = 1e-5  # of each place further down the table, so that no two combinations are equally good


@dataclass(frozen=True)
class WrenchChoice:
    """Table of all combinations of valves, with what each costs for a wanted wrench and some dead valves.

    In units of the strongest force, and of the strongest torque divided by the root of `TORQUE_WEIGHT`, combination k
    brings up w_k with n_k valves, which cost g_k = VALVE_COST n_k. Where w is wanted, the cost is
    |w_k - w|² + g_k (1 + HASTE_COST |w|²), less |w|², which does not depend on k.
    """

    commands: Array  # open (1) or closed (0), shape (k, n)
    slope: Array  # what a share of the wanted wrench makes each cheaper, shape (3, k)
    offset: Array  # cost where nothing is wanted, shape (k,)
    valve_costs: Array  # g_k, shape (k,)
    unit: Array  # shape (3,) [N, N, N·m]

    @classmethod
    def of(cls, robot: Robot, valve_cost: float = 1.0) -> WrenchChoice:
        """The table of a robot.

        Args:
            robot: The robot.
            valve_cost: Multiple of `VALVE_COST` that a valve costs: less is more exact, and uses more.

        Raises:
            ValueError: It has no on/off valves.
        """
        if not robot.actuators.binary:
            raise ValueError(f"'{robot.name}' has no on/off valves, so there is nothing to choose.")
        thrusters = robot.actuated_by(Thrusters)
        _, wrench, _ = ValveAllocation(thrusters, weight=np.eye(WRENCH), valve_cost=0.0).every
        force, torque = np.max(np.hypot(wrench[:, 0], wrench[:, 1])), np.max(np.abs(wrench[:, 2]))
        unit = np.array([force, force, torque / math.sqrt(TORQUE_WEIGHT)])
        cost = valve_cost * VALVE_COST
        table = ValveAllocation(thrusters, weight=np.diag(unit**-2.0), valve_cost=cost)
        commands, wrench, offset = table.every
        order = ORDER_COST * np.arange(len(commands))
        slope = 2.0 * FULL_SHARE * (wrench / unit).T
        parts = commands, slope, offset + order, cost * commands.sum(axis=-1), unit
        return cls(*(np.asarray(part, dtype=np.float32) for part in parts))

    def costs(self, shares: Array, dead: Array | None = None) -> Array:
        """Cost of every combination.

        Args:
            shares: Wanted wrench, each between -1 and 1, shape (rows, 3) [-].
            dead: 1 where a valve is dead, shape (rows, n); none by default.

        Returns:
            Shape (rows, k).
        """
        xp = array_namespace(shares)
        commands = xp.asarray(self.commands)
        haste = HASTE_COST * FULL_SHARE**2 * xp.sum(shares * shares, axis=-1, keepdims=True)
        cost = (
            xp.asarray(self.offset) + haste * xp.asarray(self.valve_costs) - shares @ xp.asarray(self.slope)
        )
        return cost if dead is None else cost + DEAD_COST * (dead @ commands.T)

    def shares_of(self, wrench: np.ndarray) -> np.ndarray:
        """Shares that ask for a wrench, shape (rows, 3) [N, N, N·m]; one that is out of reach keeps its direction."""
        shares = wrench / (FULL_SHARE * self.unit)
        return np.asarray(shares / np.maximum(1.0, np.linalg.norm(shares, axis=-1, keepdims=True)))

    def best(self, shares: Array, dead: Array | None = None) -> Array:
        """The cheapest combination, shape (rows, n); see `costs`."""
        xp = array_namespace(shares)
        return xp.asarray(self.commands)[xp.argmin(self.costs(shares, dead), axis=-1)]

    def margins(self, shares: Array, dead: Array | None = None) -> Array:
        """How much cheaper the best combination that opens a valve is than the best that leaves it closed, (rows, n).

        The signs say what `best` says.
        """
        xp = array_namespace(shares)
        cost = self.costs(shares, dead)[:, None, :]
        other = 1e6 * xp.asarray(self.commands.T)
        return xp.min(cost + other, axis=-1) - xp.min(cost + (1e6 - other), axis=-1)
