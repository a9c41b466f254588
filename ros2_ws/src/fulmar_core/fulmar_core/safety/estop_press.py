"""Who pressed the e-stop, as far as that can be known. No clock, no ROS; nothing is decided by it."""

from __future__ import annotations

from collections.abc import Callable

CLAIM_NS = 1_000_000_000  # a press this long before or after a claim is its own
LOOK_NS = 2_000_000_000  # after a press, in which discovery may still report the name of its publisher


class EstopPress:
    """The first press since the last reset, and who it was by.

    A program that presses says so itself. Of any other the graph is asked, which shows all publishers of the topic.
    """

    def __init__(self) -> None:
        """Begin without a press."""
        self._pressed_ns: int | None = None
        self._claims: dict[bool, tuple[str, int]] = {}  # by whether it passes a press on: who, and when [ns]
        self._guess = ""
        self._named = False

    @property
    def by(self) -> str:
        """Who pressed; empty where nothing is pressed, or where it is not known."""
        if self._pressed_ns is None:
            return ""
        return self._claimed(passes_on=False) or self._claimed(passes_on=True) or self._guess

    def claim(self, by: str, now_ns: int, *, passes_on: bool = False) -> None:
        """Take what a program says of itself; the first claim near a press counts.

        Args:
            by: Who it is.
            now_ns: Time of a steady clock [ns].
            passes_on: It presses for a caller of its service, who may have said more; then that counts.
        """
        if not self._claimed(passes_on=passes_on):
            self._claims[passes_on] = by, now_ns

    def press(self, now_ns: int) -> bool:
        """Note a press at a time of the same clock [ns]; whether it is the first since the last reset."""
        if self._pressed_ns is not None:
            return False
        self._pressed_ns, self._guess, self._named = now_ns, "", False
        return True

    def release(self) -> None:
        """Forget: a reset has succeeded."""
        self._pressed_ns, self._guess = None, ""
        self._claims.clear()

    def look(self, candidates: Callable[[], tuple[list[str], bool]], now_ns: int) -> None:
        """Ask the graph, unless it is known already who pressed, or it is too late to find out.

        Args:
            candidates: Names of the publishers, and whether all of them have one by now.
            now_ns: Time of the same clock [ns].
        """
        if self._pressed_ns is None or self._named or self._claimed(passes_on=False):
            return
        if now_ns - self._pressed_ns > LOOK_NS:
            return
        names, complete = candidates()
        if not names:
            return  # a publisher that is gone already may have been seen at an earlier look
        self._named = complete
        self._guess = names[0] if len(names) == 1 else f"one of {', '.join(names)}"

    def _claimed(self, *, passes_on: bool) -> str:
        """The claim that belongs to the press; empty without one."""
        by, claimed_ns = self._claims.get(passes_on, ("", 0))
        return by if self._pressed_ns is not None and abs(self._pressed_ns - claimed_ns) <= CLAIM_NS else ""
