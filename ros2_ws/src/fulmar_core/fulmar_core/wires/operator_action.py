"""Who did something: what an operator's program says of itself on the wire `operator/action`.

A ROS message does not name its sender. Programs that press an e-stop or give a goal say who they are beside it, so that
others need not guess by the graph. Nothing is decided by it.
"""

from __future__ import annotations

import json
from dataclasses import dataclass

ESTOP, GOAL = DOES = ("estop", "goal")
LONGEST = 200  # of who did it [characters]
LONGEST_TEXT = 4 * LONGEST


@dataclass(frozen=True)
class OperatorAction:
    """One action of an operator."""

    by: str  # node and host, or whatever people know the operator by
    does: str  # one of `DOES`
    stamp_ns: int = 0  # of the goal [ns]

    def to_text(self) -> str:
        """As the wire has it."""
        return json.dumps({"by": self.by[:LONGEST], "does": self.does, "stamp_ns": self.stamp_ns})


def read_action(text: str) -> OperatorAction | None:
    """An action from the text of the wire; None for what is none."""
    if len(text) > LONGEST_TEXT:
        return None
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return None
    if not isinstance(found, dict):
        return None
    by, does, stamp = found.get("by"), found.get("does"), found.get("stamp_ns", 0)
    fits = isinstance(by, str) and by.isprintable() and 0 < len(by) <= LONGEST
    if not isinstance(by, str) or not fits or does not in DOES or type(stamp) is not int:
        return None
    return OperatorAction(by, does, stamp)
