"""How long valves stay open at least; no clock of its own."""

from __future__ import annotations

import numpy as np


class ValveTiming:
    """Keeps a valve open until its minimum on-time is over: a solenoid that is cut short gives an unknown impulse."""

    def __init__(self, count: int, min_on_s: float) -> None:
        """Begin with closed valves.

        Args:
            count: Number of valves.
            min_on_s: Shortest opening [s].
        """
        self._min_on_ns = round(min_on_s * 1e9)
        self._opened_ns = np.full(count, -(1 << 62))
        self._open = np.zeros(count, dtype=bool)

    def allowed(self, wanted: np.ndarray, now_ns: int) -> np.ndarray:
        """What to do now.

        Args:
            wanted: Zeros and ones, shape (n,).
            now_ns: Steady clock [ns].

        Returns:
            Zeros and ones, shape (n,). Where all are wanted closed, all close at once: that is the safe command.
        """
        want = wanted > 0.5
        if want.any():
            want = want | (self._open & (now_ns - self._opened_ns < self._min_on_ns))
        self._opened_ns = np.where(want & ~self._open, now_ns, self._opened_ns)
        self._open = want
        return want.astype(float)
