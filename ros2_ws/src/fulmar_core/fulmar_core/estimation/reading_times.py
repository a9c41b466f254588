"""Stamps of an estimator's readings: which are old, and when time jumps."""

from __future__ import annotations

from fulmar_core.safety.input_gate import BACK_NS, FORWARD_NS


class TimeJumpError(Exception):
    """Time jumped: the estimator begins anew. The text says by how much."""


class ReadingTimes:
    """The newest stamp of each kind of reading."""

    def __init__(self) -> None:
        """Begin without any."""
        self._newest_ns: dict[str, int] = {}

    def problem(self, name: str, stamp_ns: int | None) -> str:
        """Why a stamp [ns] is refused; empty, and remembered, if it is not.

        Raises:
            TimeJumpError: It lies too far before or after the one before.
        """
        if stamp_ns is None:
            return f"reading of '{name}' has no stamp"
        last_ns = self._newest_ns.get(name)
        if last_ns is not None:
            ahead = stamp_ns - last_ns
            if not -BACK_NS <= ahead <= FORWARD_NS:
                raise TimeJumpError(f"time of '{name}' jumped by {ahead / 1e9:+.1f} s: a new epoch begins")
            if ahead < 0:
                return f"'{name}' is out of order: {-ahead / 1e9:g} s before a reading that came earlier"
            if ahead == 0:
                return f"stamp of '{name}' did not advance"
        self._newest_ns[name] = stamp_ns
        return ""
