"""What the actuators did between two measurements, as `actuators/state` reports it."""

from __future__ import annotations

import threading
from bisect import bisect_left, bisect_right
from dataclasses import dataclass

import numpy as np

KEPT_NS = 3_000_000_000  # of the past; longer than any interval between two measurements that is learned from


@dataclass(frozen=True, slots=True)
class Applied:
    """Commands that were applied one after another.

    Attributes:
        commands: One row each, shape (k, n).
        seconds: How long each of them held, > 0, shape (k,) [s].
    """

    commands: np.ndarray
    seconds: np.ndarray

    @property
    def duration_s(self) -> float:
        """All of them together [s]."""
        return float(self.seconds.sum())


class AppliedHistory:
    """The newest states of the actuators by their stamps; each holds until the next. Any thread may use it."""

    def __init__(self, hold_ns: int, *, kept_ns: int = KEPT_NS) -> None:
        """Begin empty.

        Args:
            hold_ns: A state says nothing about what is later than this after it [ns].
            kept_ns: Forget what is older than the newest by more [ns].
        """
        self._hold_ns, self._kept_ns = hold_ns, kept_ns
        self._stamps: list[int] = []
        self._commands: list[np.ndarray] = []
        self._lock = threading.Lock()

    @property
    def newest_ns(self) -> int:
        """Stamp of the newest state; -1 without any [ns]."""
        with self._lock:
            return self._stamps[-1] if self._stamps else -1

    @property
    def newest(self) -> np.ndarray | None:
        """The newest state, shape (n,); None without any."""
        with self._lock:
            return self._commands[-1] if self._commands else None

    def add(self, stamp_ns: int, command: np.ndarray) -> None:
        """Take a state that holds from its stamp on; one that is older than the newest begins anew.

        Args:
            stamp_ns: Its stamp [ns].
            command: Shape (n,).
        """
        with self._lock:
            old = len(self._stamps)
            if not old or stamp_ns >= self._stamps[-1]:
                old = bisect_left(self._stamps, stamp_ns - self._kept_ns)
            del self._stamps[:old], self._commands[:old]
            self._stamps.append(stamp_ns)
            self._commands.append(command)

    def between(self, begin_ns: int, end_ns: int) -> Applied | None:
        """What was applied in an interval.

        Args:
            begin_ns: Its beginning [ns].
            end_ns: Its end [ns].

        Returns:
            The commands of its whole length; None where a part of it is not known.
        """
        if end_ns <= begin_ns:
            return None
        with self._lock:
            first, last = bisect_right(self._stamps, begin_ns) - 1, bisect_left(self._stamps, end_ns)
            if first < 0:
                return None
            stamps, states = self._stamps[first:last], self._commands[first:last]
        commands: list[np.ndarray] = []
        lengths: list[int] = []
        for stamp, command, until in zip(stamps, states, [*stamps[1:], end_ns], strict=True):
            if until - stamp > self._hold_ns:
                return None
            length = until - max(stamp, begin_ns)
            if commands and np.array_equal(commands[-1], command):
                lengths[-1] += length
            elif length > 0:
                commands.append(command)
                lengths.append(length)
        return Applied(np.array(commands, dtype=float), 1e-9 * np.array(lengths, dtype=float))
