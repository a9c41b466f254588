"""What a controller believed of its actuators during a recorded run."""

from __future__ import annotations

import math

from fulmar_bags.run_record import RunRecord

STANDS_S = 1.0  # a belief that went sooner, and before the end, is none that a run is remembered for [s]


def believed_dead(record: RunRecord) -> list[str]:
    """Valves that `controller/status` named as believed dead, for a while or at the end of the run.

    Args:
        record: The run.

    Returns:
        Their names, in the order in which they were first named.
    """
    said = [sample for sample in record.health if "believed_dead" in sample.values]
    ends = [sample.log_s for sample in said[1:]] + [math.inf]
    lasted: dict[str, float] = {}
    for sample, end_s in zip(said, ends, strict=False):  # of none at all there is an end, too
        length = end_s - sample.log_s
        for name in filter(None, sample.values["believed_dead"].split(", ")):
            lasted[name] = lasted.get(name, 0.0) + length
    return [name for name, length in lasted.items() if length >= STANDS_S]


def last_beliefs(record: RunRecord) -> str:
    """What the newest `controller/status` says is believed of valves and push; empty if nothing is wrong."""
    status = record.last_health("controller")
    return status.values.get("beliefs", "") if status else ""
