"""The last word before actuators: names, values, limits and the watchdog in one place."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fulmar_core.actuators.thrusters import Thrusters
from fulmar_core.safety.command_gate import command_problem, name_problem
from fulmar_core.safety.watchdog import Watchdog


class ActuatorGuard:
    """Holds the newest acceptable command for as long as the watchdog lets it.

    Not thread-safe; the caller holds a lock.
    """

    def __init__(self, actuators: Thrusters, watchdog: Watchdog) -> None:
        """Begin with the safe command."""
        self._actuators, self.watchdog = actuators, watchdog
        self._command = actuators.safe_command
        self.rejected = 0
        self.last_rejection = ""

    def offer(self, names: Sequence[str], values: Sequence[float], now_ns: int) -> bool:
        """Take a command if it can be carried out.

        A refused command does not feed the watchdog: a controller that sends nothing but nonsense counts as silent.

        Args:
            names: Actuator names as sent.
            values: Values as sent.
            now_ns: Steady clock [ns].

        Returns:
            Whether it was taken.
        """
        command = np.asarray(values, dtype=float)
        problem = name_problem(names, self._actuators.names) or command_problem(
            command, len(self._actuators.names)
        )
        if problem:
            self.rejected += 1
            self.last_rejection = problem
            return False
        self._command = self._actuators.limited(command)
        self.watchdog.feed(now_ns)
        return True

    def output(self, now_ns: int) -> np.ndarray:
        """What to apply at this time of the steady clock [ns]."""
        return self._actuators.safe_command if self.watchdog.expired(now_ns) else self._command
