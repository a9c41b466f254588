"""Why commands of a controller are not applied, for backends whose device has a failsafe of its own."""

from __future__ import annotations

from enum import Enum
from typing import Protocol, runtime_checkable


class CommandEnd(Enum):
    """What ends commands now."""

    NONE = "none"  # they are applied
    WAITING = "waiting"  # none has come yet
    STOPPED = "stopped"  # by the e-stop, a person, a second publisher, a refusal, or the end of the plant
    SILENT = "silent"  # the watchdog: they have stopped coming


@runtime_checkable
class TakesEnds(Protocol):
    """What a backend also has whose device goes on by itself where commands end, such as an autopilot."""

    def take_end(self, end: CommandEnd) -> None:
        """Take why commands end; called before each `step` in real time, also with `NONE`, and without waiting."""
        ...
