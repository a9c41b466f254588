"""Which valves to open for the wrench that a network asks for.

A network that decides about each valve by itself has to find out which of them go together, since n open valves on one
pressure line give 1/n each; and while it explores, every wrong opening is a kick. One that asks for a wrench explores
smoothly, and what is smaller than the least useful combination opens nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.actuators.thrusters import Thrusters
from fulmar_core.arrays import array_namespace
from fulmar_core.controllers.valve_allocation import ValveAllocation
from fulmar_core.robot import Robot
from fulmar_core.rotation import Array

WRENCH = 3  # force ahead, to the left, and torque, each as a share of the strongest combination's [-]
VALVE_COST = (
    0.035  # of an open valve, where missing all of the strongest force costs 1: about what the tuned LQR's is
)
DEAD_COST = 100.0  # of opening a dead valve; more than any wrench is worth
ORDER_COST = 1e-5  # of each place further down the table, so that no two combinations are equally good


@dataclass(frozen=True)
class WrenchChoice:
    """Table of all combinations of valves, with what each costs for a wanted wrench and some dead valves.

    For wanted shares s and dead valves d (1 where dead), combination k costs `offset[k] - s @ slope[:, k] + d @
    dead_cost[:, k]`: (w_k - s)² plus its gas, less what does not depend on k.
    """

    commands: Array  # open (1) or closed (0), shape (k, n)
    slope: Array  # shape (3, k)
    offset: Array  # shape (k,)

    @classmethod
    def of(cls, robot: Robot) -> WrenchChoice:
        """The table of a robot.

        Raises:
            ValueError: It has no on/off valves.
        """
        if not isinstance(robot.actuators, Thrusters) or not robot.actuators.binary:
            raise ValueError(f"'{robot.name}' has no on/off valves, so there is nothing to choose.")
        _, wrench, _ = ValveAllocation(robot.actuators, weight=np.eye(WRENCH), valve_cost=0.0).every
        force, torque = np.max(np.hypot(wrench[:, 0], wrench[:, 1])), np.max(np.abs(wrench[:, 2]))
        strongest = np.array([force, force, torque])
        table = ValveAllocation(robot.actuators, weight=np.diag(strongest**-2.0), valve_cost=VALVE_COST)
        commands, wrench, offset = table.every
        order = ORDER_COST * np.arange(len(commands))
        slope = 2.0 * (wrench / strongest).T
        return cls(*(np.asarray(part, dtype=np.float32) for part in (commands, slope, offset + order)))

    def costs(self, shares: Array, dead: Array | None = None) -> Array:
        """Cost of every combination.

        Args:
            shares: Wanted wrench, each between -1 and 1, shape (rows, 3) [-].
            dead: 1 where a valve is dead, shape (rows, n); none by default.

        Returns:
            Shape (rows, k).
        """
        xp = array_namespace(shares)
        cost = xp.asarray(self.offset) - shares @ xp.asarray(self.slope)
        return cost if dead is None else cost + DEAD_COST * (dead @ xp.asarray(self.commands.T))

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
