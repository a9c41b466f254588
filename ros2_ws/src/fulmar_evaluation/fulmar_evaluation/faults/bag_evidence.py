"""What the bag kept of a run that something was done to, beside what a bystander heard of it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fulmar_bags.contents import open_bag
from fulmar_bags.decode import stamps_ns
from fulmar_core.errors import BagError
from fulmar_evaluation.faults.observer import Observer

TORN_S = 1.0  # a recorder that dies takes no more than so much with it
IN_FLIGHT_S = 0.1  # so long before it hangs a message may be sent that it has not taken yet


@dataclass(frozen=True)
class BagEvidence:
    """The bag, judged."""

    lost: int  # messages that came and are not in it
    intact: bool  # it opens, and lacks nothing of the time in which its recorder could work
    words: str = ""  # what is wrong; empty if nothing is


def bag_evidence(record: Path, observer: Observer, away: tuple[float, float] | None) -> BagEvidence:
    """Compare a bag with what somebody else heard.

    Args:
        record: The bag, as it lies there after everybody has ended.
        observer: Has heard what actuators did.
        away: From when to when a fault kept the recorder from its work; for ever, where it ended it [s].
    """
    heard_s, heard_ns = observer.heard()
    from_s, to_s = away or (math.inf, math.inf)
    dead = away is not None and math.isinf(to_s)
    if dead:  # what comes after its end is nobody's loss
        heard_s, heard_ns = heard_s[heard_s < from_s], heard_ns[heard_s < from_s]
    from_s, to_s = from_s - (TORN_S if dead else IN_FLIGHT_S), to_s + IN_FLIGHT_S
    try:
        bag = open_bag(record)
    except BagError as error:
        return BagEvidence(len(heard_ns), False, str(error))
    found = stamps_ns(bag.of(observer.wire))
    if found is None or not len(found):
        return BagEvidence(len(heard_ns), False, f"it has nothing of {observer.wire.name}")
    # A recorder may find the plant a little later than the bystander did.
    missing = (heard_ns >= found.min()) & ~np.isin(heard_ns, found)
    gaps = int(np.sum(missing & ~((heard_s >= from_s) & (heard_s < to_s))))
    dropped = sum((bag.recording.get("dropped") or {}).values())
    problems = [
        *([f"lacks {gaps} of {observer.wire.name}"] if gaps else []),
        *([f"its recorder dropped {dropped}"] if dropped and not dead else []),
        *(() if dead else bag.warnings),
    ]
    return BagEvidence(int(np.sum(missing)) + dropped, not problems, "; ".join(problems))
