"""When a camera with a rate takes an image, by the stamps of the states that it sees."""

from __future__ import annotations

NS = 1_000_000_000
SLACK_NS = (
    1_000_000  # by which a state may come before its time: stamps are rounded, and a clock jitters [ns]
)
LONGEST = 100  # periods without a state, after which the rate begins anew; so it does after a jump back


class FrameTimes:
    """Times of one camera.

    Attributes:
        made: Images that were due.
        missed: Those for which no state came.
    """

    def __init__(self, rate_hz: float) -> None:
        """Begin; `rate_hz` > 0 of images [Hz]."""
        self._period_ns = round(NS / rate_hz)
        self._due_ns: int | None = None  # of the next image
        self._newest_ns = -1
        self.made = self.missed = 0

    def is_due(self, time_ns: int) -> bool:
        """Whether the state of a time [ns] is to be seen; each state once."""
        if time_ns == self._newest_ns:
            return False  # a plant that waits for an answer sends its state again
        jumped = time_ns < self._newest_ns
        self._newest_ns = time_ns
        if self._due_ns is None or jumped or time_ns - self._due_ns > LONGEST * self._period_ns:
            self._due_ns = time_ns
        if time_ns < self._due_ns - SLACK_NS:
            return False
        late = max(0, time_ns + SLACK_NS - self._due_ns) // self._period_ns
        self._due_ns += (late + 1) * self._period_ns
        self.made += 1
        self.missed += late
        return True
