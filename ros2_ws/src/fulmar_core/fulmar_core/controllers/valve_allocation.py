"""Which valves to open for a wanted wrench, when valves share one pressure line.

With n open valves giving 1/n each, wrenches do not add up, so the usual pseudo-inverse or linear programme is
wrong here. The set of reachable wrenches is finite, though: we list it once and look up the best. Where it is too
large, the table holds what few valves do, and its best is improved by changing one valve or two at a time.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from fulmar_core.robots.actuators.pushing import WRENCH, Pushing, wrench_columns
from fulmar_core.states.rotation import Array

MOST_IN_TABLE = 2**16  # combinations; 16 valves take 0.2 ms a wrench, and more are searched for in less
MOST_LISTED = 2**12  # for those who weigh every combination in every step
ROUNDING = 1e-12  # a smaller gain is none
STARTS = 8  # combinations of the table that are improved
MOST_CHANGES = 12  # of one valve or two; banks of 17 to 24 valves need 0 to 5


class ValveAllocation:
    """Table of every combination of valves that is worth opening.

    Attributes:
        every: Commands (k, n), wrenches (k, 3 or 6), and costs of these without the part that depends on what is
            wanted, (k,); all combinations, or those of few valves where all would be more than `MOST_LISTED`.
        weight: Cost of a wrench error, shape (3, 3) or (6, 6).
    """

    def __init__(self, thrusters: Pushing, *, weight: np.ndarray, valve_cost: float) -> None:
        """List the combinations.

        Args:
            thrusters: The bank.
            weight: Cost of a wrench error, symmetric positive definite, shape (3, 3) or (6, 6); columns as of
                `wrench_columns`. In space the table is that of few valves (16: at most four), with a shared line
                without improvement: more of them only share the thrust out.
            valve_cost: Cost of each open valve, >= 0; settles ties in favour of fewer valves.
        """
        count = len(thrusters.names)
        self._thrusters, self._valve_cost, self.weight = thrusters, valve_cost, weight
        self._columns = wrench_columns(len(weight))
        self._whole = 2**count <= MOST_IN_TABLE
        few = self._listed(_few(count) if 2**count > MOST_LISTED else _all(count))
        if len(weight) == WRENCH:
            self._whole = thrusters.shared_pressure or len(few[0]) == 2**count
            self.every = self._table = few
        else:
            self.every, self._table = few, self._listed(_all(count)) if self._whole else few
        keep = _cheapest_of_equal_wrench(self._table[1], valve_cost * self._table[0].sum(axis=1))
        self._worth = tuple(each[keep] for each in self._table)
        self._changes = np.vstack((np.zeros(count), _of_size(count, 1), _of_size(count, 2)))

    def best(self, wanted: Array, alive: Array | None = None, dearer: Array | None = None) -> Array:
        """Combination with the least weighted error.

        A dead valve stays closed and takes no pressure from the others, so nothing is lost by never opening it.

        Args:
            wanted: Wrench in the body frame, shape (..., 3) as [F_x, F_y, M_z] in the plane, or (..., 6) [N, N·m].
            alive: 1, or 0 for valves that are dead, shape (..., n); all live by default.
            dearer: Cost of each open valve beyond `valve_cost`, shape (...,); none by default.

        Returns:
            Valves, open (1) or closed (0), shape (..., n).
        """
        some_dead = alive is not None and not np.all(alive)
        commands, wrench, offset = self._table if some_dead else self._worth
        cost = offset - 2.0 * (np.asarray(wanted) @ self.weight) @ wrench.T
        if dearer is not None:
            cost = cost + np.asarray(dearer)[..., None] * commands.sum(axis=-1)
        if some_dead:
            cost = np.where((1.0 - np.asarray(alive)) @ commands.T > 0.5, np.inf, cost)
        if self._whole:
            return commands[np.argmin(cost, axis=-1)]
        starts = commands[np.argpartition(cost, STARTS, axis=-1)[..., :STARTS]]
        return self._improved(starts, np.asarray(wanted), alive, dearer)

    def _improved(self, valves: Array, wanted: Array, alive: Array | None, dearer: Array | None) -> Array:
        """Change the one valve or the two that gain most until nothing gains, from each start, shape (..., starts, n).

        Returns:
            The best that any start led to, shape (..., n).
        """
        price = self._valve_cost + (0.0 if dearer is None else np.asarray(dearer)[..., None, None])
        lost = None if alive is None else (1.0 - np.asarray(alive))[..., None, None, :]
        for _ in range(MOST_CHANGES):
            tried = np.abs(valves[..., None, :] - self._changes)  # the first is no change
            miss = self._wrench(tried) - wanted[..., None, None, :]
            cost = np.sum((miss @ self.weight) * miss, axis=-1) + price * tried.sum(axis=-1)
            if lost is not None:
                cost = np.where(np.sum(lost * tried, axis=-1) > 0.5, np.inf, cost)
            least = np.min(cost, axis=-1)
            gains = least < cost[..., 0] - ROUNDING
            best = np.take_along_axis(tried, np.argmin(cost, axis=-1)[..., None, None], axis=-2)[..., 0, :]
            valves = np.where(gains[..., None], best, valves)
            if not np.any(gains):
                break
        return np.take_along_axis(valves, np.argmin(least, axis=-1)[..., None, None], axis=-2)[..., 0, :]

    def _listed(self, commands: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Commands, wrenches, and (w - w*)ᵀ H (w - w*) + valve cost, less what does not depend on the choice."""
        wrench = self._wrench(commands)
        offset = np.einsum("ki,ij,kj->k", wrench, self.weight, wrench)
        return commands, wrench, offset + self._valve_cost * commands.sum(axis=1)

    def _wrench(self, commands: Array) -> np.ndarray:
        """Those numbers of the wrench that count, shape (..., 3 or 6)."""
        force, torque = self._thrusters.wrench_in_body(commands)
        return np.take(np.concatenate((force, torque), axis=-1), self._columns, axis=-1)


def _all(count: int) -> np.ndarray:
    """Every combination, shape (2^count, count)."""
    return np.array(list(itertools.product((0.0, 1.0), repeat=count)))


def _few(count: int) -> np.ndarray:
    """Combinations of as many open valves as `MOST_LISTED` allows, shape (k, count)."""
    sizes = itertools.takewhile(
        lambda size: sum(math.comb(count, each) for each in range(size + 1)) <= MOST_LISTED,
        range(count),
    )
    return np.vstack([_of_size(count, size) for size in sizes])


def _of_size(count: int, size: int) -> np.ndarray:
    """All combinations of so many open valves, shape (k, count)."""
    chosen = np.array(list(itertools.combinations(range(count), size)), dtype=int)
    commands = np.zeros((len(chosen), count))
    np.put_along_axis(commands, chosen, 1.0, axis=-1)
    return commands


def _cheapest_of_equal_wrench(wrench: np.ndarray, cost: np.ndarray) -> np.ndarray:
    order = np.argsort(cost, kind="stable")
    _, first = np.unique(np.round(wrench[order], 9), axis=0, return_index=True)
    return np.sort(order[first])
