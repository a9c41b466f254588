"""When a device measured, in the host's time, told from its own clock."""

from __future__ import annotations

FORGET = 512  # reports after which the least delay is looked for anew, so that a drifting clock is followed


class DeviceTime:
    """Maps a device's clock to the host's by the report that came with the least delay.

    What is left is that least delay itself: the time that bytes need on the wire, which no clock of one side can see.
    """

    def __init__(self, wrap_ms: int = 0) -> None:
        """Begin anew.

        Args:
            wrap_ms: The device's counter begins again after so much; 0: never [ms].
        """
        self._wrap, self._last, self._turns = wrap_ms, 0.0, 0
        self._least: float | None = None
        self._next: float | None = None
        self._heard = 0

    def stamp_ns(self, device_ms: float, now_ns: int) -> int:
        """When a report was measured.

        Args:
            device_ms: Its time by the device's clock [ms].
            now_ns: The host's clock when it came, since the epoch [ns].

        Returns:
            Since the epoch, never after `now_ns` [ns].
        """
        if self._wrap and device_ms < self._last - self._wrap / 2:
            self._turns += 1
        elif device_ms < self._last - 1.0 and not self._wrap:  # it was switched off and on
            self._least = self._next = None
        self._last = device_ms
        measured_ns = (device_ms + self._turns * self._wrap) * 1e6
        delay = now_ns - measured_ns
        if self._least is None or delay < self._least or abs(delay - self._least) > 1e9:
            self._least = delay
        self._next = delay if self._next is None else min(self._next, delay)
        self._heard += 1
        if self._heard % FORGET == 0:
            self._least, self._next = self._next, None
        return min(now_ns, round(measured_ns + self._least))
