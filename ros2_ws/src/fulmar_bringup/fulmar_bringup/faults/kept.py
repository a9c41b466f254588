"""What the bag kept of a run that something was done to, beside what a bystander heard of it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fulmar_bringup.bags.contents import open_bag
from fulmar_bringup.bags.decode import stamps_ns
from fulmar_core.errors import BagError
from fulmar_core.topics import Wire


@dataclass(frozen=True)
class Kept:
    """The bag, judged."""

    lost: int  # messages that came and are not in it
    intact: bool  # it opens, and nothing is missing but what the end of its recorder tore off
    words: str = ""  # what is wrong; empty if nothing is


def kept_of(record: Path, wire: Wire, heard_ns: np.ndarray, last_ns: int | None) -> Kept:
    """Compare a bag with what somebody else heard.

    Args:
        record: The bag, as it lies there after everybody has ended.
        wire: What was heard.
        heard_ns: Stamps of it, as long as a recorder ran [ns].
        last_ns: What the recorder must have kept at least, where it was itself harmed: all up to this stamp; None
            where it was not, and must have kept all [ns].
    """
    try:
        bag = open_bag(record)
    except BagError as error:
        return Kept(len(heard_ns), False, str(error))
    found = stamps_ns(bag.of(wire))
    if found is None or not len(found):
        return Kept(len(heard_ns), False, f"the bag has nothing of {wire.name}")
    # A recorder may find the plant a little later than the bystander did.
    missing = np.setdiff1d(heard_ns[heard_ns >= found.min()], found)
    dropped = sum((bag.recording.get("dropped") or {}).values())
    gaps = missing[missing < found.max()]
    tail_lost = found.max() < (last_ns if last_ns is not None else heard_ns.max(initial=0))
    problems = [
        *([f"{len(gaps)} of {wire.name} are missing in between"] if len(gaps) else []),
        *(["its end is missing"] if tail_lost else []),
        *(bag.warnings if last_ns is None else ()),
        *([f"the recorder dropped {dropped}"] if dropped else []),
    ]
    return Kept(len(missing) + dropped, not problems, "; ".join(problems))
