"""The last word before actuators: names, values, limits and the watchdog in one place."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fulmar_core.robot import Actuators, Rolling
from fulmar_core.safety.command_gate import command_problem, name_problem
from fulmar_core.safety.watchdog import Watchdog


class ActuatorGuard:
    """Holds the newest acceptable command for as long as the watchdog lets it.

    Not thread-safe; the caller holds a lock.
    """

    def __init__(self, actuators: Actuators, watchdog: Watchdog) -> None:
        """Begin with the safe command."""
        self._actuators, self.watchdog = actuators, watchdog
        self.command = actuators.safe_command  # the newest that was taken, whatever the watchdog says
        self.rejected = 0
        self.last_rejection = ""
        self._stamp_ns = 0

    def reset(self) -> None:
        """Forget the command: a plant that starts again begins with the safe one."""
        self.command = self._actuators.safe_command
        self._stamp_ns = 0
        self.watchdog.reset()

    def offer(
        self, names: Sequence[str], values: Sequence[float], now_ns: int, *, stamp_ns: int | None = None
    ) -> bool:
        """Take a command if it can be carried out.

        A refused command does not feed the watchdog: a controller that sends nothing but nonsense counts as silent.

        Args:
            names: Actuator names as sent.
            values: Values as sent.
            now_ns: Steady clock [ns].
            stamp_ns: Stamp of the observation that it answers; None or 0 where the sender sets none [ns].

        Returns:
            Whether it was taken.
        """
        if self.watchdog.tripped:
            self._stamp_ns = 0  # one stray stamp from the future must not lock everybody out for good
        command = np.asarray(values, dtype=float)
        problem = (
            name_problem(names, self._actuators.names)
            or command_problem(command, len(self._actuators.names))
            or self._stamp_problem(stamp_ns or 0)
        )
        if problem:
            self.rejected += 1
            self.last_rejection = problem
            return False
        self.command = self._actuators.limited(command)
        self._stamp_ns = stamp_ns or self._stamp_ns
        self.watchdog.feed(now_ns)
        return True

    def output(self, now_ns: int) -> np.ndarray:
        """What to apply at this time of the steady clock [ns].

        After a silence the safe command; wheels slow down to it as fast as they may, so that they do not lock.
        """
        if not self.watchdog.expired(now_ns):
            return self.command
        slew = self._actuators.response.slew
        if not slew or not isinstance(self._actuators, Rolling):
            return self._actuators.safe_command
        since_s = max(0, self.watchdog.silent_ns(now_ns) - self.watchdog.timeout_ns) / 1e9
        left = np.maximum(np.abs(self.command) - since_s * np.asarray(slew), 0.0)
        slowed: np.ndarray = np.where(left > 0.0, np.copysign(left, self.command), 0.0)
        return slowed

    def _stamp_problem(self, stamp_ns: int) -> str | None:
        if stamp_ns and stamp_ns < self._stamp_ns:
            return f"command answers an observation {(self._stamp_ns - stamp_ns) / 1e6:.0f} ms older than the last"
        return None
