"""Shares of full thrust for a wanted wrench, for actuators that push one way by degrees and share nothing.

With W the wrenches at full thrust and u the shares, the cost is (W u - w)ᵀ H (W u - w) + c |u|², 0 <= u <= 1: a
quadratic programme with one solution. Its dual has as many numbers as a wrench, whatever the number of actuators: at
the solution u = clip(Wᵀ λ / c, 0, 1), where H⁻¹ λ + W u = w. The left side is the slope of a convex function of λ that
is quadratic piece by piece, and Newton's method with a line search finds its least value in finitely many steps
(Li and Swetits, "A new algorithm for solving strictly convex quadratic programs", SIAM J. Optim. 7(3), 1997).
"""

from __future__ import annotations

import numpy as np

from fulmar_core.robots.actuators.pushing import Pushing, wrench_columns
from fulmar_core.states.rotation import Array

LEAST_COST = (
    1e-6  # of full thrust, as a share of what missing an actuator's wrench costs: one solution, not many [-]
)
EXACT = 1e-9  # of the slope, as a share of the wanted wrench and of one actuator's [-]
MOST_STEPS = 60  # of Newton's method; six to sixteen actuators need 2 to 12


class ThrustAllocation:
    """Least-squares shares of full thrust within their limits."""

    def __init__(self, actuators: Pushing, *, weight: np.ndarray, cost: float) -> None:
        """Prepare.

        Args:
            actuators: Those that push.
            weight: Cost of a wrench error, symmetric positive definite, shape (k, k); columns as in `wrench_columns`.
            cost: Of each actuator at full thrust, >= 0.
        """
        self._full = (
            actuators.full_thrust[:, None] * actuators.wrench_per_newton[:, wrench_columns(len(weight))]
        )
        # Units in which the weight is the identity: λ, w and the slope are then of one size.
        self._root = np.linalg.cholesky(weight)
        self._columns = self._full @ self._root  # (n, k)
        size = float(np.square(self._columns).sum(axis=1).max())
        self._cost, self._scale = max(cost, LEAST_COST * size), np.sqrt(size)

    def best(self, wanted: Array, alive: Array | None = None, dearer: Array | None = None) -> Array:
        """See `Allocation.best`."""
        wanted = np.asarray(wanted, dtype=float)
        leading, count = wanted.shape[:-1], len(self._columns)
        aim = wanted.reshape(-1, len(self._root)) @ self._root
        works = np.ones((len(aim), count)) if alive is None else np.asarray(alive).reshape(-1, count)
        price = np.full(len(aim), self._cost)
        if dearer is not None:
            price = price + np.broadcast_to(dearer, leading).reshape(-1)
        lam = aim.copy()  # exact where no actuator is free
        todo = np.arange(len(aim))
        tolerance = EXACT * (self._scale + np.sqrt(np.square(aim).sum(axis=1)))
        for _ in range(MOST_STEPS):
            slope, hessian = self._slopes(lam[todo], aim[todo], works[todo], price[todo])
            open_rows = np.sqrt(np.square(slope).sum(axis=1)) > tolerance[todo]
            if not open_rows.any():
                break
            todo, slope, hessian = todo[open_rows], slope[open_rows], hessian[open_rows]
            way = -np.linalg.solve(hessian, slope[..., None])[..., 0]
            length = self._length(lam[todo], way, aim[todo], works[todo], price[todo])
            lam[todo] += length[:, None] * way
        return self._shares(lam, works, price).reshape(*leading, count)

    def _shares(self, lam: np.ndarray, works: np.ndarray, price: np.ndarray) -> np.ndarray:
        """Shares of full thrust that belong to a dual solution, shape (rows, n)."""
        return np.asarray(works * np.clip(_rows(lam, self._columns) / price[:, None], 0.0, 1.0))

    def _slopes(
        self, lam: np.ndarray, aim: np.ndarray, works: np.ndarray, price: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Slope (rows, k) and second derivative (rows, k, k) of the dual function."""
        pull = _rows(lam, self._columns) / price[:, None]
        shares = works * np.clip(pull, 0.0, 1.0)
        slope = lam + _rows(shares, self._columns.T) - aim
        free = works * ((pull > 0.0) & (pull < 1.0)) / price[:, None]
        return slope, np.eye(len(self._root)) + np.einsum("rn,ni,nj->rij", free, self._columns, self._columns)

    def _length(
        self,
        lam: np.ndarray,
        way: np.ndarray,
        aim: np.ndarray,
        works: np.ndarray,
        price: np.ndarray,
    ) -> np.ndarray:
        """How far to go along a way, shape (rows,): to where the dual function is least.

        Its slope along the way is straight between the points at which an actuator becomes free or full.
        """
        start, rise = _rows(lam, self._columns), _rows(way, self._columns)
        ends = np.stack((-start, price[:, None] - start), axis=-1).reshape(len(lam), -1)
        rises = np.repeat(rise, 2, axis=1)
        points = np.sort(
            np.where(rises == 0.0, 0.0, np.maximum(ends / np.where(rises == 0.0, 1.0, rises), 0.0))
        )
        points = np.concatenate((np.zeros((len(lam), 1)), points, points[:, -1:] + 1.0), axis=1)
        pull = start[:, None] + points[..., None] * rise[:, None]  # (rows, points, n)
        shares = works[:, None] * np.clip(pull / price[:, None, None], 0.0, 1.0)
        steady, bend = np.sum(way * (lam - aim), axis=1), np.sum(way * way, axis=1)
        slopes = steady[:, None] + points * bend[:, None] + np.einsum("rpn,rn->rp", shares, rise)
        after = np.clip(np.argmax(slopes >= 0.0, axis=1), 1, None)
        after = np.where((slopes < 0.0).all(axis=1), points.shape[1] - 1, after)[:, None]
        (low, high), (before, beyond) = (
            [np.take_along_axis(each, after + shift, axis=1)[:, 0] for shift in (-1, 0)]
            for each in (points, slopes)
        )
        return np.asarray(low - before * (high - low) / np.maximum(beyond - before, 1e-300))


def _rows(rows: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Rows (r, k) times the transpose of a matrix (n, k), in one order whatever the number of rows."""
    return np.asarray(np.einsum("rk,nk->rn", rows, matrix))
