"""The emergency stop: what who owns the button decides, and what who hears it must do. No clock, no ROS.

Fail-safe by liveness: a stop that falls silent counts as pressed.
"""

from __future__ import annotations

TIMEOUT_NS = 500_000_000  # republished at 10 Hz, so that four may get lost
QUIET_NS = 500_000_000  # commands older than this no longer count against a reset
REPUBLISH_HZ = 10.0
HOLDS = "e-stop:"  # how every reason begins
SILENT = f"{HOLDS} silent"  # and how the one does that nobody may have given by a press


class EstopWatch:
    """Judges from what is heard on the wire whether anything may move."""

    def __init__(self, *, required: bool, timeout_ns: int = TIMEOUT_NS) -> None:
        """Begin without having heard anything.

        Args:
            required: Whether nothing may move before an e-stop is heard. Where it is not, one that was heard once must
                still go on.
            timeout_ns: Longest silence, > 0 [ns].
        """
        self._required, self._timeout_ns = required, timeout_ns
        self._heard_ns: int | None = None
        self._pressed_ns: int | None = None
        self._released = False
        self._orphaned = False  # pressed, and its button has fallen silent since
        self.was_released = False  # whether it ever allowed anything

    def hear(self, pressed: bool, now_ns: int) -> None:
        """Note a message, at this time of a steady clock [ns].

        Of two buttons the pressed one counts: a release within the timeout after a press is not believed. Nor is one
        from a button that was silent while it was pressed: whoever started it anew knows nothing of the press. A reset
        says "pressed" first, which makes it believed.
        """
        silent = self._heard_ns is not None and now_ns - self._heard_ns > self._timeout_ns
        self._orphaned = not pressed and (self._orphaned or (silent and not self._released))
        self._heard_ns = now_ns
        if pressed:
            self._pressed_ns = now_ns
            self._released = False
        elif not self._orphaned and (
            self._pressed_ns is None or now_ns - self._pressed_ns > self._timeout_ns
        ):
            self._released = True
            self.was_released = True

    @property
    def heard(self) -> bool:
        """Whether there is, or was, one."""
        return self._heard_ns is not None

    def reason(self, now_ns: int) -> str:
        """Why nothing may move at this time of the same clock; empty if it may [ns]."""
        if self._heard_ns is None:
            return f"{HOLDS} none is heard, and one is required" if self._required else ""
        silent_ns = now_ns - self._heard_ns
        if silent_ns > self._timeout_ns:
            return f"{SILENT} for {silent_ns / 1e6:.0f} ms (limit {self._timeout_ns / 1e6:.0f} ms)"
        if self._orphaned:
            return f"{HOLDS} it was pressed when it fell silent. Reset it: fulmar estop --reset"
        return "" if self._released else f"{HOLDS} pressed"


class EstopButton:
    """Latched: once pressed it stays so until it is reset while every command is zero."""

    def __init__(self) -> None:
        """Begin released."""
        self.pressed = False
        self._moving: dict[str, tuple[int, bool]] = {}

    def press(self) -> None:
        """Stop everything."""
        self.pressed = True

    def hear_command(self, source: str, zero: bool, now_ns: int) -> None:
        """Note a command.

        Args:
            source: The wire that it came on.
            zero: Whether it moves nothing.
            now_ns: Steady clock [ns].
        """
        self._moving[source] = now_ns, not zero

    def reset(self, now_ns: int) -> str:
        """Release it, unless somebody commands motion, which would begin at once.

        Args:
            now_ns: Steady clock [ns].

        Returns:
            Why it stays pressed; empty if it is released.
        """
        for source, (heard_ns, moves) in sorted(self._moving.items()):
            if moves and now_ns - heard_ns <= QUIET_NS:
                return f"refused: the newest command on {source} is not zero. Stop who sends it, then reset."
        self.pressed = False
        return ""
