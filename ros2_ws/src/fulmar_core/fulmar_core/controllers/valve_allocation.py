"""Which valves to open for a wanted wrench, when valves share one pressure line.

With n open valves giving 1/n each, wrenches do not add up, so the usual pseudo-inverse or linear programme is
wrong here. The set of reachable wrenches is finite, though, and small: we list it once and look up the best.
"""

from __future__ import annotations

import itertools

import numpy as np

from fulmar_core.actuators.thrusters import Thrusters
from fulmar_core.rotation import Array

MAX_VALVES = 12  # 4,096 combinations; beyond it the table costs more than it is worth


class ValveAllocation:
    """Table of every combination of valves that is worth opening."""

    def __init__(self, thrusters: Thrusters, *, weight: np.ndarray, valve_cost: float) -> None:
        """List the combinations.

        Args:
            thrusters: The bank.
            weight: Cost of a wrench error [F_x, F_y, M_z], symmetric positive definite, shape (3, 3).
            valve_cost: Cost of each open valve, >= 0; settles ties in favour of less gas.
        """
        count = len(thrusters.nozzles)
        if count > MAX_VALVES:
            raise ValueError(f"{count} valves make too many combinations (at most {MAX_VALVES} valves).")
        commands = np.array(list(itertools.product((0.0, 1.0), repeat=count)))
        force, torque = thrusters.wrench_in_body(commands)
        wrench = np.concatenate((force[:, 0:2], torque[:, 2:3]), axis=1)
        cost = valve_cost * commands.sum(axis=1)
        keep = _cheapest_of_equal_wrench(wrench, cost)
        self._commands, self._wrench, self._weight = commands[keep], wrench[keep], weight
        # (w - w*)ᵀ H (w - w*) + cost, less the part that does not depend on the choice.
        self._offset = np.einsum("ki,ij,kj->k", self._wrench, weight, self._wrench) + cost[keep]

    def best(self, wanted: Array) -> Array:
        """Combination with the least weighted error.

        Args:
            wanted: Wrench [F_x, F_y, M_z] in the body frame, shape (..., 3) [N, N, N·m].

        Returns:
            Valves, open (1) or closed (0), shape (..., n).
        """
        cost = self._offset - 2.0 * (np.asarray(wanted) @ self._weight) @ self._wrench.T
        return self._commands[np.argmin(cost, axis=-1)]


def _cheapest_of_equal_wrench(wrench: np.ndarray, cost: np.ndarray) -> np.ndarray:
    order = np.argsort(cost, kind="stable")
    _, first = np.unique(np.round(wrench[order], 9), axis=0, return_index=True)
    return np.sort(order[first])
