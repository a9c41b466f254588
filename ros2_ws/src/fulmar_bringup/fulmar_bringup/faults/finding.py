"""What came of one fault."""

from __future__ import annotations

import time
from dataclasses import dataclass

from fulmar_bringup.faults.live_system import LiveSystem
from fulmar_bringup.faults.witness import wait_for

WORDS_S = 2.0  # a node says what is wrong within a second, on a machine that has time for it
STAYS_S = 1.0  # what is safe must stay so


@dataclass(frozen=True)
class Finding:
    """One line of the report."""

    name: str
    detected_by: str  # the node that said first what is wrong; empty if nobody did
    reaction: str  # in its own words
    time_to_safe_s: (
        float | None
    )  # from the fault to the last moment at which anything moved; None: it went on [s]
    limit_s: float | None  # None: the robot is to go on [s]
    passed: bool


def stopped(live: LiveSystem, name: str, since_s: float, limit_s: float) -> Finding:
    """Whether a robot that moved got safe in time, stayed so, and somebody said why.

    Args:
        live: The system.
        name: Of the fault.
        since_s: When it was done, on the monotonic clock [s].
        limit_s: The longest time to the safe state [s].
    """
    witness = live.witness
    wait_for(lambda: time.monotonic() > since_s + limit_s + STAYS_S, limit_s + 2.0 * STAYS_S)
    applied = witness.applied_since(since_s)
    unsafe = [heard_s for heard_s, moves in applied if moves]
    safe = [heard_s for heard_s, moves in applied if not moves and heard_s > max(unsafe, default=0.0)]
    time_s = max(0.0, safe[0] - since_s) if safe and unsafe else 0.0 if safe else None
    wait_for(lambda: witness.complaint_since(since_s) is not None, WORDS_S)
    word = witness.complaint_since(since_s)
    passed = time_s is not None and time_s <= limit_s and word is not None
    return Finding(name, word.who if word else "", word.text if word else "", time_s, limit_s, passed)


def went_on(
    live: LiveSystem, name: str, since_s: float, *, detected_by: str, reaction: str, told: bool
) -> Finding:
    """Whether a robot went on, without a pause as long as its watchdog, and the right thing was said.

    Args:
        live: The system.
        name: Of the fault.
        since_s: When it was done [s].
        detected_by: Who said it; empty if nobody did.
        reaction: What was said.
        told: Whether that is what had to be said.
    """
    words = live.witness.words_since(since_s - WORDS_S)  # with one from before, to compare with
    trips = {word.values.get("watchdog_trips", "") for word in words if word.who == "plant"}
    held = len(trips) == 1
    return Finding(name, detected_by, reaction, None, None, told and held)
