"""Control by the clock: steps at a steady beat, each shortly after the measurement that it acts on has come."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

from fulmar_core.process import CONTROL_PRIORITY, take_priority, take_priority_with_helpers
from fulmar_ros.deadline import Deadlines
from fulmar_ros.phase_lock import ArrivalPhase

PATIENCE_S = 2.0  # for a controller that hangs, before the node goes on without it
FRESH_NS = 3_000_000  # a measurement that came so shortly before a beat is the one that was due
PATIENCE = 0.25  # of a period, for a measurement that is late
PATIENCE_AT_FIRST = 0.9  # the same while nobody knows yet when measurements come
COPY_AFTER = 0.2  # of a period; the copies of a command are over before the next one


class ControlBeat:
    """A thread of its own that calls a control step, from `start` to `halt`.

    Attributes:
        deadlines: How punctual the beat is.
    """

    def __init__(self, period_s: float, *, rate: float, copies: int) -> None:
        """Stand still.

        Args:
            period_s: Wall-clock time between steps, > 0 [s].
            rate: Seconds of the measurements' stamps a second of wall-clock.
            copies: How often each command is sent, within its period.
        """
        self._period_s, self._rate, self._copies = period_s, rate, copies
        self._stop = threading.Event()
        self._arrived = threading.Event()  # a measurement, since a beat waits for one
        self._thread: threading.Thread | None = None
        self.renew()

    def renew(self) -> None:
        """Forget how punctual beat and measurements were."""
        self.deadlines = Deadlines(self._period_s)
        self._phase = ArrivalPhase(self._rate)
        self._arrived_ns: int | None = None

    @property
    def hangs(self) -> bool:
        """Whether the last step of a beat that was halted is not over yet."""
        return self._stop.is_set() and self._thread is not None and self._thread.is_alive()

    def start(
        self, step: Callable[[], None], copy: Callable[[], object], failed: Callable[[str], None]
    ) -> None:
        """Begin; not while the last beat hangs.

        Args:
            step: One control step.
            copy: Sends the command of the step once more.
            failed: Told why the beat has come to an end by itself.
        """
        self._stop.clear()
        self._thread = threading.Thread(
            target=self._run, args=(step, copy, failed), name="control", daemon=True
        )
        self._thread.start()

    def halt(self) -> None:
        """End the beat, and wait for its last step, not for ever."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join(PATIENCE_S)

    def follow(self, stamp_ns: int) -> None:
        """A measurement has come that can be used: let the beat follow the arrivals.

        Args:
            stamp_ns: Its stamp [ns].
        """
        if self._arrived_ns is None:
            take_priority_with_helpers(CONTROL_PRIORITY)
        self._arrived_ns = time.monotonic_ns()
        anchor = self._phase.anchor_ns(stamp_ns, self._arrived_ns)
        if anchor is not None:
            self.deadlines.align(anchor)

    def wake(self) -> None:
        """Whatever a beat waits for has come."""
        self._arrived.set()

    def _run(
        self, step: Callable[[], None], copy: Callable[[], object], failed: Callable[[str], None]
    ) -> None:
        take_priority(CONTROL_PRIORITY)
        try:
            while self.deadlines.wait(self._stop):
                self._wait_for_what_is_due()
                step()
                for _ in range(self._copies - 1):
                    if not self._stop.wait(COPY_AFTER * self._period_s):
                        copy()
        except Exception as error:  # noqa: BLE001 - a loop that ended without a word would look like one that waits
            failed(f"the control loop raised {type(error).__name__}: {error}")

    def _wait_for_what_is_due(self) -> None:
        """Wait a moment for the measurement that comes with this beat: what is acted on is as young as it can be."""
        self._arrived.clear()
        last_ns = self._arrived_ns
        if last_ns is not None and time.monotonic_ns() - last_ns > FRESH_NS:
            self._arrived.wait((PATIENCE if self._phase.known else PATIENCE_AT_FIRST) * self._period_s)
