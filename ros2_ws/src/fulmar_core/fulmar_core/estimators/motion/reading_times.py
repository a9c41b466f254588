"""Stamps of an estimator's readings: which are old, and when time jumps."""

from __future__ import annotations

from collections.abc import Callable

from fulmar_core.wires.reading import BACK_NS, FORWARD_NS


class ReadingTimes:
    """The newest stamp of each kind of reading."""

    def __init__(self, on_jump: Callable[[], None]) -> None:
        """Begin without any; `on_jump` is called where time jumps and a new epoch begins."""
        self._newest_ns: dict[str, int] = {}
        self._on_jump = on_jump

    def problem(self, name: str, stamp_ns: int | None) -> str:
        """Why a stamp is refused; empty, and remembered, if it is not.

        Args:
            name: What the readings are called, as words show it.
            stamp_ns: Stamp [ns]; None where a reading has none.
        """
        if stamp_ns is None:
            return f"reading of {name} has no stamp"
        last_ns = self._newest_ns.get(name)
        if last_ns is not None:
            ahead = stamp_ns - last_ns
            if not -BACK_NS <= ahead <= FORWARD_NS:
                self._newest_ns.clear()
                self._on_jump()
                return f"time of {name} jumped by {ahead / 1e9:+.1f} s: a new epoch begins"
            if ahead <= 0:
                order = f", it is out of order: {-ahead / 1e9:g} s before the newest" if ahead else ""
                return f"stamp of {name} did not advance{order}"
        self._newest_ns[name] = stamp_ns
        return ""
