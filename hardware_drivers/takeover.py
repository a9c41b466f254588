"""Taking an aircraft over from its autopilot in flight, and giving it back where commands end."""

from __future__ import annotations

from enum import Enum

from fulmar_core.safety.command_end import CommandEnd

OBEYS_S = 3.0  # for a mode to show in what the autopilot says of itself


class Doing(Enum):
    """What a driver does at a tick."""

    REST = "rest"  # it sends nothing
    PROVE = "prove"  # it shows that it lives, before the autopilot is asked for the mode
    ASK = "ask"  # it asks for the mode in which the autopilot takes set points
    FLY = "fly"  # it sends set points
    HOLD = "hold"  # it asks the autopilot to hold


class Takeover:
    """The craft is the driver's from the first command until commands end; a pilot who takes it keeps it."""

    def __init__(self, autopilot: str, mode: str, *, proof_s: float) -> None:
        """Begin without the craft.

        Args:
            autopilot: Its name, for words.
            mode: In which it takes set points.
            proof_s: So long it has to see the driver before it changes to that mode [s].
        """
        self._autopilot, self._mode, self._proof_s = autopilot, mode, proof_s
        self._since_s: float | None = None  # when the driver began to want the craft
        self._had = False  # whether it had it since then

    def doing(self, end: CommandEnd, has: bool, now_s: float) -> Doing:
        """What to do at a time of the steady clock [s]; `has` is whether the autopilot is in the mode."""
        if end is CommandEnd.SILENT:
            return Doing.REST
        if end is not CommandEnd.NONE:
            if end is CommandEnd.STOPPED and self._since_s is not None and has:
                return Doing.HOLD
            self._since_s, self._had = None, False
            return Doing.REST
        if self._since_s is None:
            self._since_s, self._had = now_s, False
        if has:
            self._had = True
            return Doing.FLY
        return Doing.PROVE if self._had or now_s - self._since_s < self._proof_s else Doing.ASK

    def refusal(self, end: CommandEnd, has: bool, now_s: float, *, mode: str, answer: str) -> str:
        """Why the autopilot takes no set points; empty while it does, and while it should not.

        Args:
            end: As in `doing`.
            has: Same.
            now_s: Same.
            mode: Its mode, in words.
            answer: What it said to being asked, in words; empty for nothing.
        """
        if self._since_s is None or has or end is CommandEnd.STOPPED:
            return ""
        if self._had:
            return f"{self._autopilot} is in mode {mode}, not {self._mode}: it takes no set points"
        if now_s - self._since_s > self._proof_s + OBEYS_S:
            why = answer or "no effect"
            return f"{self._autopilot} refuses mode {self._mode}: {why}; it is in mode {mode}"
        return ""
