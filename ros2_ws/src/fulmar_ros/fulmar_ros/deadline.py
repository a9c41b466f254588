"""Absolute deadlines on a monotonic clock: late is counted, never made up for in a burst."""

from __future__ import annotations

import threading
import time
from collections import deque

import numpy as np

KEPT = 20_000  # newest samples that percentiles are taken over

NS = 1_000_000_000
LONG_NS = NS // 2
EARLY_NS = 300_000  # stay awake for the last of the wait; longer would keep callbacks from the interpreter


class Spread:
    """Percentiles of the newest samples of one quantity."""

    def __init__(self) -> None:
        """Begin empty."""
        self._samples: deque[float] = deque(maxlen=KEPT)

    def add(self, value: float) -> None:
        """Note one sample."""
        self._samples.append(value)

    def values(self) -> np.ndarray:
        """The newest samples, in their order."""
        return np.fromiter(self._samples, dtype=float)

    def percentiles(self, name: str) -> dict[str, str]:
        """`<name>_p50`, `_p99` and `_max` as text for diagnostics; empty texts before the first sample."""
        if not self._samples:
            return {f"{name}_{key}": "" for key in ("p50", "p99", "max")}
        values = self.values()
        p50, p99 = np.percentile(values, (50, 99))
        return {
            f"{name}_p50": f"{p50:.4f}",
            f"{name}_p99": f"{p99:.4f}",
            f"{name}_max": f"{values.max():.4f}",
        }


class Deadlines:
    """A steady beat: wait for the next deadline, know how late it came."""

    def __init__(self, period_s: float) -> None:
        """Beat with this period, > 0 [s]."""
        self._period_ns = round(period_s * NS)
        self._next_ns: int | None = None
        self._last_ns: int | None = None
        self._first_ns: int | None = None
        self._anchor_ns: int | None = None
        self.beats = 0
        self.overruns = 0
        self.late_in_a_row = 0  # beats, each of which missed its deadline by a period or more
        self.period_error_ms = Spread()

    def align(self, anchor_ns: int) -> None:
        """Beat from now on at this instant and whole periods after it.

        A controller that beats shortly after its measurements come acts on fresh ones.

        Args:
            anchor_ns: Monotonic clock [ns].
        """
        self._anchor_ns = anchor_ns

    def wait(self, stop: threading.Event) -> bool:
        """Sleep until the next deadline; the first one is now.

        Deadlines that have passed already are skipped and counted as overruns.

        Args:
            stop: Set by another thread to end the beat.

        Returns:
            False if `stop` is set.
        """
        if self._next_ns is None:
            self._next_ns = time.monotonic_ns()
        ahead = self._next_ns - time.monotonic_ns()
        if ahead > LONG_NS:  # slow enough to be told to stop meanwhile
            stop.wait((ahead - LONG_NS) / NS)
            ahead = self._next_ns - time.monotonic_ns()
        if ahead > EARLY_NS and not stop.is_set():
            time.sleep((ahead - EARLY_NS) / NS)  # wakes more punctually than waiting for an event
        while time.monotonic_ns() < self._next_ns and not stop.is_set():
            time.sleep(0.0)  # a sleeper wakes late; who only lets others pass does not
        if stop.is_set():
            return False
        now = time.monotonic_ns()
        if self._last_ns is not None:
            self.period_error_ms.add(abs(now - self._last_ns - self._period_ns) / 1e6)
        self._first_ns = self._first_ns or now
        self._last_ns = now
        self.beats += 1
        self._next_ns += self._period_ns
        self.late_in_a_row = self.late_in_a_row + 1 if self._next_ns <= now else 0
        while self._next_ns <= now:
            self._next_ns += self._period_ns
            self.overruns += 1
        if self._anchor_ns is not None:
            self._next_ns = now + self._period_ns - (now - self._anchor_ns) % self._period_ns
            # The step to the new beat is no error of the period; rate and errors count from here.
            self._anchor_ns = self._last_ns = self._first_ns = None
            self.beats = self.overruns = 0
            self.period_error_ms = Spread()
        return True

    @property
    def rate_hz(self) -> float:
        """Beats per second so far, 0 before the second [Hz]."""
        if self._first_ns is None or self._last_ns is None or self._last_ns == self._first_ns:
            return 0.0
        return (self.beats - 1) * NS / (self._last_ns - self._first_ns)
