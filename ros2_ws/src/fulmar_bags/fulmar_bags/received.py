"""What a node was told in a recorded run, and when."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

ABSENT = -1


@dataclass(frozen=True)
class Told:
    """Something that the controller was told."""

    log_ns: int  # [ns]
    stamp_ns: int  # [ns]
    what: Any  # a Goal, discs of shape (m, 3), a place of shape (2,), a bool or a text
    index: int = ABSENT  # of the message in its topic
