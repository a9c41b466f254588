"""Whether the launcher of this node still runs: one that is stopped starts no lost node again, and ends no run."""

from __future__ import annotations

import os
import time
from collections.abc import Callable

from fulmar_core.config.process import LAUNCHER_PID, is_stopped

LOOK_S = 0.5  # between two looks
STOPPED_S = 1.0  # after which it is reported; a debugger or a suspended computer stops processes for moments
WORDS = "the launcher is stopped: it starts no lost node again, and does not end the run"


class LauncherWatch:
    """Looks at the process that started this one now and then."""

    def __init__(self, *, stopped: Callable[[int], bool] = is_stopped) -> None:
        """Begin; a process that no launcher started has nothing to watch."""
        launcher = os.environ.get(LAUNCHER_PID, "")
        self._launcher = int(launcher) if launcher.isdecimal() else 0
        self._stopped = stopped
        self._looked_s = 0.0
        self._since_s: float | None = None

    def problem(self, now_s: float | None = None) -> str:
        """What is wrong with the launcher, empty if nothing is; `now_s` is by the monotonic clock [s]."""
        now_s = time.monotonic() if now_s is None else now_s
        if self._launcher and now_s - self._looked_s >= LOOK_S:
            self._looked_s = now_s
            if not self._stopped(self._launcher):
                self._since_s = None
            elif self._since_s is None:
                self._since_s = now_s
        return WORDS if self._since_s is not None and now_s - self._since_s >= STOPPED_S else ""
