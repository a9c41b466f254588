"""Control by the clock: absolute deadlines, arrival times of measurements, and the thread that steps a controller."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable

import numpy as np

from fulmar_core.config.process import CONTROL_PRIORITY, take_priority, take_priority_with_helpers

KEPT = 20_000  # newest samples that percentiles are taken over

NS = 1_000_000_000
LONG_NS = NS // 2
EARLY_NS = 300_000  # stay awake for the last of the wait; longer would keep callbacks from the interpreter


class Spread:
    """Percentiles of the newest samples of one quantity."""

    def __init__(self) -> None:
        """Begin empty."""
        self._samples: deque[float] = deque(maxlen=KEPT)

    def add(self, value: float) -> None:
        """Note one sample."""
        self._samples.append(value)

    def values(self) -> np.ndarray:
        """The newest samples, in their order."""
        return np.fromiter(self._samples, dtype=float)

    def percentiles(self, name: str) -> dict[str, str]:
        """`<name>_p50`, `_p99` and `_max` as text for diagnostics; empty texts before the first sample."""
        if not self._samples:
            return {f"{name}_{key}": "" for key in ("p50", "p99", "max")}
        values = self.values()
        p50, p99 = np.percentile(values, (50, 99))
        return {
            f"{name}_p50": f"{p50:.4f}",
            f"{name}_p99": f"{p99:.4f}",
            f"{name}_max": f"{values.max():.4f}",
        }


class Deadlines:
    """A steady beat of absolute deadlines; those that are missed are counted, never made up for in a burst."""

    def __init__(self, period_s: float) -> None:
        """Beat with this period, > 0 [s]."""
        self._period_ns = round(period_s * NS)
        self._next_ns: int | None = None
        self._last_ns: int | None = None
        self._first_ns: int | None = None
        self._anchor_ns: int | None = None
        self.beats = 0
        self.overruns = 0
        self.late_in_a_row = 0  # beats, each of which missed its deadline by a period or more
        self.period_error_ms = Spread()

    def align(self, anchor_ns: int) -> None:
        """Beat from now on at this instant of the monotonic clock [ns] and whole periods after it.

        A controller that beats shortly after its measurements come acts on fresh ones.
        """
        self._anchor_ns = anchor_ns

    def change(self, period_s: float) -> None:
        """Beat with another period, > 0 [s], from the next beat on."""
        self._period_ns, self._last_ns = round(period_s * NS), None

    def begin_anew(self) -> None:
        """The beat has rested on purpose: what passed meanwhile is no overrun, and the next deadline is now."""
        self._next_ns = self._last_ns = None

    def wait(self, stop: threading.Event) -> bool:
        """Sleep until the next deadline; the first one is now. False once another thread has set `stop`.

        Deadlines that have passed already are skipped and counted as overruns.
        """
        if self._next_ns is None:
            self._next_ns = time.monotonic_ns()
        ahead = self._next_ns - time.monotonic_ns()
        if ahead > LONG_NS:  # slow enough to be stopped meanwhile
            stop.wait((ahead - LONG_NS) / NS)
            ahead = self._next_ns - time.monotonic_ns()
        if ahead > EARLY_NS and not stop.is_set():
            time.sleep((ahead - EARLY_NS) / NS)  # wakes more punctually than waiting for an event
        while time.monotonic_ns() < self._next_ns and not stop.is_set():
            time.sleep(0.0)  # a sleeping thread wakes late; one that only yields does not
        if stop.is_set():
            return False
        now = time.monotonic_ns()
        if self._last_ns is not None:
            self.period_error_ms.add(abs(now - self._last_ns - self._period_ns) / 1e6)
        self._first_ns = self._first_ns or now
        self._last_ns = now
        self.beats += 1
        self._next_ns += self._period_ns
        self.late_in_a_row = self.late_in_a_row + 1 if self._next_ns <= now else 0
        while self._next_ns <= now:
            self._next_ns += self._period_ns
            self.overruns += 1
        if self._anchor_ns is not None:
            self._next_ns = now + self._period_ns - (now - self._anchor_ns) % self._period_ns
            # The step to the new beat is no error of the period; rate and errors count from here.
            self._anchor_ns = self._last_ns = self._first_ns = None
            self.beats = self.overruns = 0
            self.period_error_ms = Spread()
        return True

    @property
    def rate_hz(self) -> float:
        """Beats per second so far, 0 before the second [Hz]."""
        if self._first_ns is None or self._last_ns is None or self._last_ns == self._first_ns:
            return 0.0
        return (self.beats - 1) * NS / (self._last_ns - self._first_ns)


LISTEN = 25  # measurements; the least delayed of them sets the phase
LEAD_NS = 1_000_000  # a beat comes so long before the least delayed measurement, and waits for the one due


class ArrivalPhase:
    """Finds the instant just before measurements arrive.

    The scheduler delays single arrivals, most of all the first ones, but not their stamps.
    """

    def __init__(self, rate: float) -> None:
        """Expect stamps that run `rate` times as fast as the wall clock."""
        self._rate = rate
        self._arrivals = 0
        self._least_ns: float | None = None

    @property
    def known(self) -> bool:
        """Whether enough measurements have come."""
        return self._arrivals >= LISTEN

    def anchor_ns(self, stamp_ns: int, arrival_ns: int) -> int | None:
        """Instant on the monotonic clock to beat at, once, after enough arrivals; else None [ns].

        Args:
            stamp_ns: Stamp of the measurement that arrived [ns].
            arrival_ns: Its arrival on the monotonic clock [ns].
        """
        if self._arrivals >= LISTEN:
            return None
        delay = arrival_ns - stamp_ns / self._rate
        self._least_ns = delay if self._least_ns is None else min(self._least_ns, delay)
        self._arrivals += 1
        if self._arrivals < LISTEN:
            return None
        return round(stamp_ns / self._rate + self._least_ns - LEAD_NS / max(1.0, self._rate))


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
        """Do not run yet.

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
        """Start the thread; not while the last one hangs.

        Args:
            step: One control step.
            copy: Sends the command of the step once more.
            failed: Receives the error that ended the thread.
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
        """Let the beat follow the arrivals: a usable measurement of this stamp has come [ns]."""
        if self._arrived_ns is None:
            take_priority_with_helpers(CONTROL_PRIORITY)
        self._arrived_ns = time.monotonic_ns()
        anchor = self._phase.anchor_ns(stamp_ns, self._arrived_ns)
        if anchor is not None:
            self.deadlines.align(anchor)

    def wake(self) -> None:
        """Wake a beat that waits for a measurement."""
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
        except Exception as error:  # noqa: BLE001 - a loop that ended silently would look like one that waits
            failed(f"the control loop raised {type(error).__name__}: {error}")

    def _wait_for_what_is_due(self) -> None:
        """Wait a moment for the measurement that is due with this beat, so that the step acts on the freshest one."""
        self._arrived.clear()
        last_ns = self._arrived_ns
        if last_ns is not None and time.monotonic_ns() - last_ns > FRESH_NS:
            self._arrived.wait((PATIENCE if self._phase.known else PATIENCE_AT_FIRST) * self._period_s)
