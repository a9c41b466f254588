"""Wheels that are told to turn while their encoders stand: odometry is no measurement any more."""

from __future__ import annotations

import numpy as np

LEAST = 0.05  # rims that are told less may be held by friction alone [m/s]
LONGEST_S = 1.0  # our value: a base has long begun to roll by then


class StandingWheels:
    """Watches one encoder for each wheel."""

    def __init__(self) -> None:
        """Begin with the next reading."""
        self._counts: np.ndarray | None = None

    def problem(self, told: np.ndarray, counts: np.ndarray, time_s: float) -> str:
        """Take a reading.

        Args:
            told: Speed of each rim that was asked for, shape (n,) [m/s].
            counts: Of each encoder, shape (n,).
            time_s: When it was read [s].

        Returns:
            What is wrong; empty if nothing is.
        """
        if self._counts is None:
            self._counts, self._moved_s = counts, np.full(len(counts), time_s)
        well = (counts != self._counts) | (np.abs(told) < LEAST)
        self._counts, self._moved_s = counts, np.where(well, time_s, self._moved_s)
        if np.all(time_s - self._moved_s <= LONGEST_S):
            return ""
        return (
            f"a wheel is told to turn, and its encoder has stood for {LONGEST_S:g} s. "
            "Is the base blocked, or a cable off?"
        )
