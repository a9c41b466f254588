"""Time of a simulated plant."""

from __future__ import annotations

from dataclasses import dataclass

from fulmar_core.topics import SIMULATION_START_NS


@dataclass
class SimulatedTime:
    """A clock that only moves on, also across episodes."""

    now_ns: int = SIMULATION_START_NS

    def advance(self, seconds: float) -> None:
        """Move on [s]."""
        self.now_ns += round(seconds * 1e9)
