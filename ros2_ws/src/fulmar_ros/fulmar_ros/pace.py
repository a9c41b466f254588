"""When the loop of a simulated plant may take its next tick."""

from __future__ import annotations

import threading

LOOK_S = 0.05  # between two looks at whether the loop is to stop


class Pace:
    """Whether a simulation may take its next control step: it runs, or was asked for single ones."""

    def __init__(self, ticks: int = 1) -> None:
        """It runs; a control step is so many of the loop's ticks long."""
        self._changed = threading.Condition()
        self.paused = False
        self._step_ticks, self._ticks = ticks, 0

    def pause(self, paused: bool) -> None:
        """Hold before the next control step, or go on; from any thread."""
        with self._changed:
            self.paused, self._ticks = paused, 0
            self._changed.notify_all()

    def step(self, steps: int = 1) -> bool:
        """Take some control steps more; False where it is not paused. From any thread."""
        with self._changed:
            self._ticks += steps * self._step_ticks * self.paused
            self._changed.notify_all()
            return self.paused

    def _may_go(self, stop: threading.Event) -> bool:
        return not self.paused or self._ticks > 0 or stop.is_set()

    def wait(self, stop: threading.Event) -> None:
        """Return once a tick may begin. Asked by the plant's loop alone; `stop` ends it."""
        if not self.paused:
            return
        with self._changed:
            while not self._changed.wait_for(lambda: self._may_go(stop), LOOK_S):
                pass
            if self._ticks:
                self._ticks -= 1


ALWAYS = Pace()  # of a plant that nothing pauses
