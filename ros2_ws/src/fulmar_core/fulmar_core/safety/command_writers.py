"""One node commands a robot: while two publish commands, the robot holds its safe state."""

from __future__ import annotations

from collections.abc import Sequence

SETTLE_NS = 1_000_000_000  # the safe state lasts this long after one of two publishers is gone


class CommandWriters:
    """Reports why commands are not carried out, from the nodes that publish them. No clock, no ROS.

    The hold is not latched. A controller that is started again overlaps for some seconds with the one that has died,
    until discovery misses the dead one; no person is needed to go on after that.
    """

    def __init__(self, *, settle_ns: int = SETTLE_NS) -> None:
        """Begin without a publisher.

        Args:
            settle_ns: How long the hold lasts after the second publisher is gone, >= 0 [ns].
        """
        self._settle_ns = settle_ns
        self._names: tuple[str, ...] = ()
        self._seen_ns: int | None = None

    def see(self, names: Sequence[str], now_ns: int) -> None:
        """Note which nodes publish commands now.

        Args:
            names: Full name of each node; the same name twice where two processes have it.
            now_ns: Steady clock [ns].
        """
        if len(names) > 1:
            self._names, self._seen_ns = tuple(names), now_ns

    def reason(self, now_ns: int) -> str:
        """Why commands are not carried out at this time of the same clock; empty if they are [ns]."""
        if self._seen_ns is None or now_ns - self._seen_ns > self._settle_ns:
            return ""
        return f"{len(self._names)} nodes publish commands, and only one may: {', '.join(self._names)}"
