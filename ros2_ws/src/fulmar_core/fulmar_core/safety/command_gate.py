"""The gate after a controller, and again before an actuator: only commands that can be carried out pass."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fulmar_core.errors import shortened

REJECTIONS_TO_LATCH = 3


def command_problem(command: np.ndarray, shape: tuple[int, ...]) -> str | None:
    """What is wrong with the commands of one robot or of many.

    Args:
        command: Any array.
        shape: The one that it must have; actuators along the last axis.

    Returns:
        A reason for people, or None if it may be limited and applied.
    """
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
        """Note the verdict on one command.

        Args:
            reason: Why it was refused, or None if it was not.

        Returns:
            The fault to latch, or None.
        """
        if reason is None:
            self._in_a_row = 0
            return None
        self.total += 1
        self._in_a_row += 1
        if self._in_a_row >= self._to_latch:
            return f"{self._in_a_row} commands in a row were refused, the last because {reason}"
        return None
