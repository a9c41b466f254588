"""Gate of commands: shape, values, names, and a single publisher."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fulmar_core.config.errors import shortened

REJECTIONS_TO_LATCH = 3


def command_problem(command: np.ndarray, shape: tuple[int, ...]) -> str | None:
    """Reason why commands cannot be applied; None if they can. Actuators lie along the last axis of `shape`."""
    if command.shape != shape:
        return f"command has shape {command.shape}, must be {shape}"
    if not np.isfinite(command).all():
        return f"command for actuator {int(np.argwhere(~np.isfinite(command))[0, -1]) + 1} is not finite"
    return None


def name_problem(names: Sequence[str], needed: Sequence[str]) -> str | None:
    """What is wrong with the actuator names of a command, or None."""
    if len(names) != len(needed):
        return f"command names {len(names)} actuators, must name {len(needed)}"
    for number, (found, expected) in enumerate(zip(names, needed, strict=True), start=1):
        if found != expected:
            return f"command names '{shortened(found)}' as actuator {number}, must be '{expected}'"
    return None


class Rejections:
    """Counts refusals; several in a row are a fault that stays."""

    def __init__(self, to_latch: int = REJECTIONS_TO_LATCH) -> None:
        """Latch after this many in a row, > 0."""
        self.total = 0
        self._in_a_row, self._to_latch = 0, to_latch

    def note(self, reason: str | None) -> str | None:
        """Count a command that was refused for a reason, or accepted (None); returns the fault to latch, or None."""
        if reason is None:
            self._in_a_row = 0
            return None
        self.total += 1
        self._in_a_row += 1
        if self._in_a_row >= self._to_latch:
            return f"{self._in_a_row} commands in a row were refused, the last because {reason}"
        return None


SETTLE_NS = 1_000_000_000  # the safe state lasts this long after one of two publishers is gone


class OneWriter:
    """Reports why a topic is not followed, from the nodes that publish it. No clock, no ROS.

    The hold is not latched. A node that is started again overlaps for some seconds with the one that has died, until
    discovery misses the dead one; no person is needed to go on after that.
    """

    def __init__(self, what: str = "commands", *, settle_ns: int = SETTLE_NS) -> None:
        """Begin without a publisher.

        Args:
            what: Is published, for people.
            settle_ns: How long the hold lasts after the second publisher is gone, >= 0 [ns].
        """
        self._what, self._settle_ns = what, settle_ns
        self._names: tuple[str, ...] = ()
        self._seen_ns: int | None = None

    def see(self, names: Sequence[str], now_ns: int) -> None:
        """Note which nodes publish it now.

        Args:
            names: Full name of each node; the same name twice where two processes have it.
            now_ns: Steady clock [ns].
        """
        if len(names) > 1:
            self._names, self._seen_ns = tuple(names), now_ns

    def reason(self, now_ns: int) -> str:
        """Why it is not followed at this time of the same clock; empty if it is [ns]."""
        if self._seen_ns is None or now_ns - self._seen_ns > self._settle_ns:
            return ""
        return f"{len(self._names)} nodes publish {self._what}, and only one may: {', '.join(self._names)}"
