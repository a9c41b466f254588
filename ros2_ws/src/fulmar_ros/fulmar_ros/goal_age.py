"""Goals from before a reset of the e-stop, which a latched publisher may deliver long after it."""

from __future__ import annotations

import time
from collections.abc import Mapping

BEFORE_RESET = (
    "goal was published before the e-stop was reset, by the clock of its computer. Give it anew; if it is new, set the "
    "clocks of both computers"
)


class GoalAge:
    """Compares when goals were published with the newest reset, or, before one, with the begin."""

    def __init__(self, *, counts: bool) -> None:
        """Begin; where it does not count, no goal is too old."""
        self._counts = counts
        self._reset_ns = time.time_ns()  # by the wall clock, as DDS stamps messages

    def reset(self) -> None:
        """Note a reset of the e-stop."""
        self._reset_ns = time.time_ns()

    def problem(self, info: Mapping[str, int]) -> str:
        """Why the goal of a message with this info is too old; empty if it is not."""
        return BEFORE_RESET if self._counts and info["source_timestamp"] < self._reset_ns else ""
