"""Watchdog next to the actuators: commands must keep coming."""

from __future__ import annotations

from fulmar_core.config.errors import SafetyError
from fulmar_core.wires.silence import LONGEST_S

NO_COMMAND = "no command for"  # how the report of a trip begins


def checked_timeout(seconds: float) -> float:
    """A chosen timeout, if it protects; 0 switches the watchdog off, which its owner must shout about [s].

    Raises:
        SafetyError: If it is not a number from 0 to 0.5 s.
    """
    if not 0.0 <= seconds <= LONGEST_S:
        raise SafetyError(
            f"the command timeout is {seconds:g} s; it must be from 0 (off) to {LONGEST_S:g} s."
        )
    return seconds


class Watchdog:
    """Says whether commands have stopped; knows no clock of its own."""

    def __init__(self, timeout_ns: int) -> None:
        """Wait for `timeout_ns` [ns].

        Raises:
            SafetyError: If the timeout would not protect.
        """
        if timeout_ns <= 0:
            raise SafetyError(f"the command timeout is {timeout_ns} ns; it must be greater than 0.")
        self.timeout_ns = timeout_ns
        self.trips = 0
        self._last_ns: int | None = None
        self._held_ns: int | None = None
        self._tripped = False

    def reset(self) -> None:
        """As before the first command; counted trips stay."""
        self._last_ns = None
        self._tripped = False

    def feed(self, now_ns: int) -> None:
        """A command has come at this time of a steady clock [ns]."""
        self._last_ns = now_ns
        self._tripped = False

    def hold(self, now_ns: int) -> None:
        """Time of a simulation stands still from now on, and no command is due until `go_on` [ns]."""
        self._held_ns = now_ns

    def go_on(self, now_ns: int) -> None:
        """Time goes on; the silence has lasted as long as when it was held [ns]."""
        if self._last_ns is not None and self._held_ns is not None:
            self._last_ns = min(self._last_ns + now_ns - self._held_ns, now_ns)
        self._held_ns = None

    def expired(self, now_ns: int) -> bool:
        """Whether actuators must be in their safe state at this time [ns].

        Before the first command that is so, but no trip: nothing has stopped yet. Each silence counts once.
        """
        if self._last_ns is None:
            return True
        late = self.silent_ns(now_ns) > self.timeout_ns
        if late and not self._tripped:
            self._tripped = True
            self.trips += 1
        return late

    @property
    def tripped(self) -> bool:
        """Whether commands came once and have stopped."""
        return self._tripped

    def silent_ns(self, now_ns: int) -> int:
        """Time since the last command, 0 before the first [ns]."""
        if self._last_ns is None:
            return 0
        until_ns = now_ns if self._held_ns is None else max(self._held_ns, self._last_ns)
        return until_ns - self._last_ns
