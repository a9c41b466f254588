"""Time of a real plant."""

from __future__ import annotations

import time


class WallTime:
    """The clock of the machine: it moves by itself, and all machines of a robot are to agree on it (PTP, chrony)."""

    @property
    def now_ns(self) -> int:
        """Since the epoch [ns]."""
        return time.time_ns()

    def advance(self, seconds: float) -> None:
        """Nothing to do: real time passes anyway [s]."""
