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
    """Table of every combination of valves that is worth opening.

    Attributes:
        every: Commands (k, n), wrenches (k, 3), and costs of these without the part that depends on what is wanted,
        (k,). weight: Cost of a wrench error, shape (3, 3).
    """

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
        # (w - w*)ᵀ H (w - w*) + cost, less the part that does not depend on the choice.
        offset = np.einsum("ki,ij,kj->k", wrench, weight, wrench) + cost
        keep = _cheapest_of_equal_wrench(wrench, cost)
        self.every, self._worth = (commands, wrench, offset), (commands[keep], wrench[keep], offset[keep])
        self.weight = weight

    def best(self, wanted: Array, alive: Array | None = None, dearer: Array | None = None) -> Array:
        """Combination with the least weighted error.

        A dead valve stays closed and takes no gas from the others, so nothing is lost by never opening it.

        Args:
            wanted: Wrench [F_x, F_y, M_z] in the body frame, shape (..., 3) [N, N, N·m].
            alive: 1, or 0 for valves that are dead, shape (..., n); all live by default.
            dearer: Cost of each open valve beyond `valve_cost`, shape (...,); none by default.

        Returns:
            Valves, open (1) or closed (0), shape (..., n).
        """
        some_dead = alive is not None and not np.all(alive)
        commands, wrench, offset = self.every if some_dead else self._worth
        cost = offset - 2.0 * (np.asarray(wanted) @ self.weight) @ wrench.T
        if dearer is not None:
            cost = cost + np.asarray(dearer)[..., None] * commands.sum(axis=-1)
        if some_dead:
            cost = np.where((1.0 - np.asarray(alive)) @ commands.T > 0.5, np.inf, cost)
        return commands[np.argmin(cost, axis=-1)]


def _cheapest_of_equal_wrench(wrench: np.ndarray, cost: np.ndarray) -> np.ndarray:
    order = np.argsort(cost, kind="stable")
    _, first = np.unique(np.round(wrench[order], 9), axis=0, return_index=True)
    return np.sort(order[first])
