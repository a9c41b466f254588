"""Recursive least squares of the inertia with forgetting, on balances of momentum."""

from __future__ import annotations

import numpy as np

from fulmar_core.estimators.inertia.momentum_balance import cumulated

SPAN = 20  # samples of a balance
MEMORY_S = 60.0  # after which a balance counts 1/e


class RecursiveFit:
    """One balance after another; each begins where the last one ended.

    Attributes:
        numbers: Of the inertia, shape (count,) [kg·m²].
        covariance: Of these, shape (count, count).
    """

    def __init__(self, first: np.ndarray, *, spread: float, noise: float, memory_s: float = MEMORY_S) -> None:
        """Begin with a guess.

        Args:
            first: Guess of the inertia's numbers, shape (count,) [kg·m²].
            spread: Its standard deviation, as a share of the largest one [-].
            noise: Standard deviation of the momentum that a balance misses [N·m·s].
            memory_s: Time after which a balance counts 1/e [s].
        """
        self.numbers = np.array(first, dtype=float)
        self._most = (spread * float(np.abs(first).max())) ** 2 * np.eye(len(first))
        self.covariance, self._noise, self._memory_s = self._most, noise, memory_s
        self._rate: list[np.ndarray] = []
        self._momentum: list[np.ndarray] = []
        self._times: list[float] = []

    def add(self, rate: np.ndarray, momentum: np.ndarray, time_s: float) -> None:
        """Take a sample; arguments as one row of those of `momentum_balance.cumulated`."""
        self._rate.append(np.asarray(rate))
        self._momentum.append(np.asarray(momentum))
        self._times.append(time_s)
        if len(self._times) <= SPAN:
            return
        times = np.array(self._times)
        left, right = cumulated(np.array(self._rate), np.array(self._momentum), times, len(self.numbers))
        self._update(left[-1] - left[0], right[-1] - right[0], float(times[-1] - times[0]))
        for kept in (self._rate, self._momentum, self._times):
            del kept[:-1]

    def forget(self) -> None:
        """Believe the guess no more than at the start, as after the inertia changed."""
        self.covariance = self._most

    def _update(self, rows: np.ndarray, aim: np.ndarray, seconds: float) -> None:
        # What is forgotten where nothing is excited must not grow beyond what was known at the start.
        grown = self.covariance / np.exp(-seconds / self._memory_s)
        excess = np.diag(grown) > np.diag(self._most)
        prior = self.covariance if excess.any() else grown
        spread = rows @ prior @ rows.T + self._noise**2 * np.eye(3)
        gain = np.linalg.solve(spread, rows @ prior).T
        self.numbers = self.numbers + gain @ (aim - rows @ self.numbers)
        left = np.eye(len(self.numbers)) - gain @ rows
        self.covariance = left @ prior @ left.T + self._noise**2 * gain @ gain.T
