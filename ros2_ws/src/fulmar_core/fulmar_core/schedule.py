"""Goals that begin at a time of their own: whoever sends one says so with a stamp ahead of the plant's clock."""

from __future__ import annotations

from typing import Generic, TypeVar

LONGEST_AHEAD_NS = (
    600_000_000_000  # a stamp further ahead is of another clock, as a person's beside a simulation's
)
SLACK_NS = 1_000  # of rounding between a sender's seconds and the plant's

T = TypeVar("T")


def begins_ns(stamp_ns: int, now_ns: int) -> int:
    """When something begins.

    Args:
        stamp_ns: Its stamp; 0 or the past mean at once [ns].
        now_ns: The plant's clock when it came [ns].

    Returns:
        The plant's clock when it begins [ns].
    """
    return stamp_ns if now_ns < stamp_ns <= now_ns + LONGEST_AHEAD_NS else now_ns


class Schedule(Generic[T]):
    """Things that begin one after another; a new one takes the place of all that would begin with it or later."""

    def __init__(self) -> None:
        """Begin empty."""
        self._entries: list[tuple[int, T]] = []  # when each begins [ns], in order; what is over is forgotten
        self._arrived: list[tuple[int, T]] = []  # stamps; when they begin is known once the plant's clock is

    def give(self, item: T, stamp_ns: int) -> None:
        """Take something new with its stamp [ns]."""
        self._arrived.append((stamp_ns, item))

    def at(self, now_ns: int) -> T | None:
        """What goes on at a time of the plant's clock, never less than before [ns]; None before anything has begun."""
        for stamp_ns, item in self._arrived:
            begin_ns = begins_ns(stamp_ns, now_ns)
            self._entries = [entry for entry in self._entries if entry[0] < begin_ns] + [(begin_ns, item)]
        self._arrived.clear()
        while len(self._entries) > 1 and self._entries[1][0] <= now_ns + SLACK_NS:
            del self._entries[0]
        if not self._entries or self._entries[0][0] > now_ns + SLACK_NS:
            return None
        return self._entries[0][1]
