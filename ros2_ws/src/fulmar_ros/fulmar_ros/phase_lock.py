"""When measurements really come, so that a controller's beat can be there just before them."""

from __future__ import annotations

LISTEN = 25  # measurements; the least delayed of them tells the phase
EARLY_NS = (
    1_000_000  # a beat comes so long before the least delayed measurement, and waits for the one that is due
)


class ArrivalPhase:
    """Finds the instant just before measurements arrive.

    Single arrivals are late by the scheduler's whim, most of all the first ones; stamps are not.
    """

    def __init__(self, rate: float) -> None:
        """Listen to stamps that run `rate` times as fast as the wall clock."""
        self._rate = rate
        self._heard = 0
        self._least_ns: float | None = None

    @property
    def known(self) -> bool:
        """Whether enough measurements have come."""
        return self._heard >= LISTEN

    def anchor_ns(self, stamp_ns: int, arrival_ns: int) -> int | None:
        """Note one arrival.

        Args:
            stamp_ns: Stamp of the measurement [ns].
            arrival_ns: Monotonic clock when it came [ns].

        Returns:
            The instant on the monotonic clock to beat at, once, after enough arrivals; else None [ns].
        """
        if self._heard >= LISTEN:
            return None
        delay = arrival_ns - stamp_ns / self._rate
        self._least_ns = delay if self._least_ns is None else min(self._least_ns, delay)
        self._heard += 1
        if self._heard < LISTEN:
            return None
        return round(stamp_ns / self._rate + self._least_ns - EARLY_NS / max(1.0, self._rate))
