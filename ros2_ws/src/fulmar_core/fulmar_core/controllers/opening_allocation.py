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

from fulmar_core.robots.actuators.pushing import Pushing
from fulmar_core.states.rotation import Array

MOST = 4  # corners in a mixture: one more than a wrench has numbers
ROUNDING = 1e-9  # a part this far below 0 is 0, and costs this near to each other are equal


class OpeningAllocation:
    """Table of every set of valves that may work together."""

    def __init__(self, thrusters: Pushing, *, weight: np.ndarray, valve_cost: float) -> None:
        """List the sets.

        Args:
            thrusters: The bank; its valves share one pressure line.
            weight: Cost of a wrench error [F_x, F_y, M_z], symmetric positive definite, shape (3, 3).
            valve_cost: Cost of a fully open valve, >= 0.
        """
        count = len(thrusters.names)
        if not thrusters.shared_pressure:
            raise ValueError(
                "valves that open by degrees need 'shared_pressure'; there is no allocation without."
            )
        force, torque = thrusters.wrench_in_body(np.eye(count))
        corners = np.concatenate((force[:, 0:2], torque[:, 2:3]), axis=1)
        corners, price = np.vstack((np.zeros(3), corners)), np.append(0.0, np.full(count, valve_cost))
        sets = [
            list(chosen)
            for size in range(1, MOST + 1)
            for chosen in itertools.combinations(range(count + 1), size)
            if np.linalg.matrix_rank(corners[list(chosen)] - corners[chosen[0]], tol=1e-9) == size - 1
        ]
        # Everything about a set is linear in the wanted wrench: its parts, its error and its price.
        slopes, levels = np.zeros((len(sets), MOST, 3)), np.zeros((len(sets), MOST))
        errors, offsets = np.zeros((len(sets), 3, 3)), np.zeros((len(sets), 3))
        prices, fees = np.zeros((len(sets), 3)), np.zeros(len(sets))
        root = np.linalg.cholesky(weight).T  # |root e|² is the cost of an error e
        self._members = np.zeros((len(sets), MOST), dtype=int)
        for i, chosen in enumerate(sets):
            slope, level = _best_parts(corners[chosen], price[chosen], weight)
            self._members[i, : len(chosen)] = chosen
            slopes[i, : len(chosen)], levels[i, : len(chosen)] = slope, level
            errors[i] = root @ (corners[chosen].T @ slope - np.eye(3))
            offsets[i] = root @ corners[chosen].T @ level
            prices[i], fees[i] = price[chosen] @ slope, price[chosen] @ level
        self._parts = slopes.reshape(-1, 3).T, levels
        self._errors = errors.reshape(-1, 3).T, offsets
        self._prices = prices.T, fees
        self._valves = count

    def best(self, wanted: Array, alive: Array | None = None, dearer: Array | None = None) -> Array:
        """Openings with the least weighted error and price.

        Args:
            wanted: Wrench [F_x, F_y, M_z] in the body frame, shape (..., 3) [N, N, N·m].
            alive: 1, or 0 for valves that are dead, shape (..., n); all live by default.
            dearer: As in `ValveAllocation.best`; not used here, where each opening costs little.

        Returns:
            Openings from 0 to 1 that add up to at most 1, shape (..., n).
        """
        wanted = np.asarray(wanted, dtype=float)
        leading, count = wanted.shape[:-1], len(self._members)
        parts = (wanted @ self._parts[0]).reshape(*leading, count, MOST) + self._parts[1]
        error = (wanted @ self._errors[0]).reshape(*leading, count, 3) + self._errors[1]
        cost = np.sum(error * error, axis=-1) + wanted @ self._prices[0] + self._prices[1]
        cost = np.where(np.min(parts, axis=-1) >= -ROUNDING, cost, np.inf)
        if alive is not None and not np.all(alive):
            lives = np.concatenate(
                (np.ones((*leading, 1)), np.asarray(alive)), axis=-1
            )  # as doing nothing does
            cost = np.where(np.min(lives[..., self._members], axis=-1) > 0.5, cost, np.inf)
        least = np.min(cost, axis=-1, keepdims=True)
        best = np.argmax(cost <= least + ROUNDING * (1.0 + least), axis=-1)  # of equals always the same
        chosen = np.take_along_axis(parts, best[..., None, None], axis=-2)[..., 0, :]
        openings = np.zeros((*leading, self._valves + 1))
        # What fills up a small set is the corner of doing nothing, which is no valve.
        np.put_along_axis(openings, self._members[best], np.clip(chosen, 0.0, 1.0), axis=-1)
        return openings[..., 1:]


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
