"""Valves that are believed dead and are opened again now and then, since a belief may be wrong and a valve recover.

A valve that is never opened shows nothing, so what an estimator believes of it would stay for ever.
"""

from __future__ import annotations

import numpy as np

LONGEST_S = 60.0  # each further trial waits twice as long, up to this [s]
# A valve has had its trial once it was open for so long: that distinguishes a dead valve from a good one [s]
OPENINGS_S = 0.2


class ValveTrials:
    """Times of the valves of one robot, or of many at once; arrays of shape (..., n)."""

    def __init__(self, retry_s: float) -> None:
        """Begin with valves that were never believed dead.

        Args:
            retry_s: A valve has its first trial so long after it was believed dead, > 0 [s].
        """
        self._retry_s = retry_s
        self.reset()

    def reset(self) -> None:
        """Forget every trial."""
        self._dead_s: np.ndarray | None = None  # since it is believed dead, or since its last trial [s]

    def allowed(self, alive: np.ndarray, opened: np.ndarray | None, dt: float) -> np.ndarray:
        """Which valves may be opened now.

        Args:
            alive: 1, or 0 for valves that are believed dead, shape (..., n).
            opened: What was open since the last call, same shape, 1 for open; None where that is not known.
            dt: Time since the last call [s].

        Returns:
            1 for those that are alive or have their trial, else 0; same shape.
        """
        dead = np.asarray(alive) < 0.5
        if not dead.any() and (self._dead_s is None or opened is not None):
            self._dead_s = None
            return alive
        if self._dead_s is None or self._dead_s.shape != dead.shape:
            self._dead_s = np.zeros(dead.shape)
            self._wait_s = np.full(dead.shape, self._retry_s)
            self._tried_s = np.zeros(dead.shape)
        self._dead_s = np.where(dead, self._dead_s + dt, 0.0)
        on_trial = dead & (self._dead_s >= self._wait_s)
        if opened is not None:
            self._tried_s = np.where(on_trial, self._tried_s + dt * (np.asarray(opened) > 0.0), 0.0)
        over = on_trial & (self._tried_s >= OPENINGS_S - 1e-6)
        self._wait_s = np.where(
            dead, np.where(over, np.minimum(2.0 * self._wait_s, LONGEST_S), self._wait_s), self._retry_s
        )
        self._dead_s = np.where(over, 0.0, self._dead_s)
        return np.where(on_trial & ~over, 1.0, alive)
