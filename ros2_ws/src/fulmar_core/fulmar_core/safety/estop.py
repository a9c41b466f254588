"""Emergency stop: the button that one node owns, and the monitor of every node that obeys it. No clock, no ROS.

A press latches until a reset. An e-stop node that falls silent counts as pressed.
"""

from __future__ import annotations

TIMEOUT_NS = 500_000_000  # republished at 10 Hz, so that four may get lost
QUIET_NS = 500_000_000  # commands older than this no longer count against a reset
REPUBLISH_HZ = 10.0
HOLDS = "e-stop:"  # how every reason begins
SILENT = f"{HOLDS} silent"  # and how the one does that nobody may have given by a press


class EstopMonitor:
    """Decides from the messages of the e-stop whether anything may move.

    One press latches, from any publisher. Only `release`, which follows a successful reset, ends it. An e-stop node
    shows that it is alive by its messages; once it has said "released", its silence stops the robot too.
    """

    def __init__(self, *, required: bool, timeout_ns: int = TIMEOUT_NS) -> None:
        """Begin without any message.

        Args:
            required: Whether nothing may move before an e-stop node says "released". Where it is not, one that was
                there once must still go on.
            timeout_ns: Longest silence, > 0 [ns].
        """
        self._required, self._timeout_ns = required, timeout_ns
        self._pressed = False
        self._alive_ns: int | None = None  # newest message, since one said "released"
        self.was_released = not required  # whether it ever allowed anything

    def receive(self, pressed: bool, now_ns: int) -> None:
        """Take a message of the e-stop, at this time of a steady clock [ns].

        A "released" shows that an e-stop node is there, and that it was not pressed as far as it knows; it does not
        end a press. A press alone shows no node: it may be the one message of any publisher.
        """
        if pressed:
            self._pressed = True
        if not pressed or self._alive_ns is not None:
            self._alive_ns = now_ns
        self.was_released = self.was_released or not (pressed or self._pressed)

    def release(self, now_ns: int) -> None:
        """End a press: a reset has succeeded, at this time of the same clock [ns].

        A reset without an e-stop node also ends the silence of one that is gone: where one is required, it must be
        started again.
        """
        self._pressed = False
        if self._silent_ns(now_ns) > self._timeout_ns:
            self._alive_ns = None

    @property
    def received(self) -> bool:
        """Whether it has been pressed since the last reset, or an e-stop node is, or was, there."""
        return self._pressed or self._alive_ns is not None

    def reason(self, now_ns: int) -> str:
        """Why nothing may move at this time of the same clock; empty if it may [ns]."""
        if self._pressed:
            return f"{HOLDS} pressed. Reset it: fulmar estop --reset"
        if self._alive_ns is None:
            return f"{HOLDS} none is received, and one is required" if self._required else ""
        silent_ns = self._silent_ns(now_ns)
        if silent_ns > self._timeout_ns:
            return f"{SILENT} for {silent_ns / 1e6:.0f} ms (limit {self._timeout_ns / 1e6:.0f} ms)"
        return ""

    def _silent_ns(self, now_ns: int) -> int:
        """Time since the newest message of an e-stop node, 0 where there was none [ns]."""
        return 0 if self._alive_ns is None else now_ns - self._alive_ns


class EstopButton:
    """Latched: once pressed it stays so until it is reset while every command is zero."""

    def __init__(self) -> None:
        self.pressed = False
        self._moving: dict[str, tuple[int, bool]] = {}

    def press(self) -> None:
        """Stop everything."""
        self.pressed = True

    def receive_command(self, source: str, zero: bool, now_ns: int) -> None:
        """Note a command on a topic at a time of the steady clock [ns], and whether it is zero and moves nothing."""
        self._moving[source] = now_ns, not zero

    def reset(self, now_ns: int) -> str:
        """Release it at a time of the steady clock [ns], unless a command moves the robot, which would begin at once.

        Returns:
            Why it stays pressed; empty if it is released.
        """
        for source, (received_ns, moves) in sorted(self._moving.items()):
            if moves and now_ns - received_ns <= QUIET_NS:
                return f"refused: the newest command on {source} is not zero. Stop who sends it, then reset."
        self.pressed = False
        return ""
