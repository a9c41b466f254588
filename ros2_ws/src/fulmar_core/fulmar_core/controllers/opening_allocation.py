"""How far to open valves that open by degrees, for a wanted wrench, when they share one pressure line.

Openings give c / max(1, sum of c) of the full thrust each, so the shares are never negative and never add up
to more than 1: reachable wrenches are the convex hull of what each valve does alone, and of doing nothing.
The nearest point of a hull in three dimensions is a mixture of at most four of its corners (Caratheodory;
Rockafellar, "Convex Analysis", 1970, §17), and the best mixture of given corners is a linear function of the
wanted wrench. So we list the sets of corners once, and take the cheapest mixture without negative parts.
"""

from __future__ import annotations

import itertools

import numpy as np

from fulmar_core.actuators.thrusters import Thrusters
from fulmar_core.controllers.valve_allocation import MAX_VALVES
from fulmar_core.rotation import Array

ROUNDING = 1e-9  # a part this far below 0 is 0


class OpeningAllocation:
    """Table of every set of valves that may work together."""

    def __init__(self, thrusters: Thrusters, *, weight: np.ndarray, valve_cost: float) -> None:
        """List the sets.

        Args:
            thrusters: The bank; its valves share one pressure line.
            weight: Cost of a wrench error [F_x, F_y, M_z], symmetric positive definite, shape (3, 3).
            valve_cost: Cost of a fully open valve, >= 0.
        """
        count = len(thrusters.nozzles)
        if count > MAX_VALVES:
            raise ValueError(f"{count} valves make too many combinations (at most {MAX_VALVES} valves).")
        if not thrusters.shared_pressure:
            raise ValueError(
                "valves that open by degrees need 'shared_pressure'; there is no allocation without."
            )
        force, torque = thrusters.wrench_in_body(np.eye(count))
        corners = np.concatenate((force[:, 0:2], torque[:, 2:3]), axis=1)
        corners, price = np.vstack((np.zeros(3), corners)), np.append(0.0, np.full(count, valve_cost))
        self._corners, self._price, self._weight = corners, price, weight
        sets = [
            chosen
            for size in range(1, 5)
            for chosen in itertools.combinations(range(count + 1), size)
            if np.linalg.matrix_rank(corners[list(chosen)] - corners[chosen[0]], tol=1e-9) == size - 1
        ]
        maps = [_best_parts(corners[list(chosen)], price[list(chosen)], weight) for chosen in sets]
        self._slopes, self._levels = np.zeros((len(sets), count + 1, 3)), np.zeros((len(sets), count + 1))
        for i, (chosen, (slope, level)) in enumerate(zip(sets, maps, strict=True)):
            self._slopes[i, list(chosen)], self._levels[i, list(chosen)] = slope, level

    def best(self, wanted: Array) -> Array:
        """Openings with the least weighted error and price.

        Args:
            wanted: Wrench [F_x, F_y, M_z] in the body frame, shape (..., 3) [N, N, N·m].

        Returns:
            Openings from 0 to 1 that add up to at most 1, shape (..., n).
        """
        wanted = np.asarray(wanted, dtype=float)
        parts = np.einsum("sci,...i->...sc", self._slopes, wanted) + self._levels
        miss = parts @ self._corners - wanted[..., None, :]
        cost = np.sum((miss @ self._weight) * miss, axis=-1) + parts @ self._price
        cost = np.where(np.min(parts, axis=-1) >= -ROUNDING, cost, np.inf)
        best = np.argmin(cost, axis=-1)[..., None, None]
        return np.clip(np.take_along_axis(parts, best, axis=-2)[..., 0, 1:], 0.0, 1.0)


def _best_parts(corners: np.ndarray, price: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Parts that add up to 1 and minimise the error's cost, whatever their sign: slope @ wanted + level.

    Args:
        corners: Wrenches that are mixed, affinely independent, shape (k, 3).
        price: Of each, shape (k,).
        weight: Cost of an error, shape (3, 3).

    Returns:
        Slope (k, 3) and level (k,).
    """
    k = len(corners)
    spread = np.vstack((-np.ones(k - 1), np.eye(k - 1)))  # parts = first corner + spread @ free
    edges = corners.T @ spread
    hessian = edges.T @ weight @ edges
    slope = np.linalg.solve(hessian, edges.T @ weight)
    level = -slope @ corners[0] - 0.5 * np.linalg.solve(hessian, spread.T @ price)
    return spread @ slope, spread @ level + np.eye(k)[0]
