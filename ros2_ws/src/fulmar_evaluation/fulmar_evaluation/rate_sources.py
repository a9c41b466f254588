"""Which sensor a satellite's turn rate came from over a run, and when its gyroscope fell silent."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fulmar_bags.run_record import RunRecord

SILENT_S = 1.0  # of a gyroscope before the end of a run that is its death [s]
GYROSCOPE = "gyroscope"


@dataclass(frozen=True)
class RateSource:
    """One source, and the time in which the estimator used it, since the first state [s]."""

    name: str  # gyroscope, events or wheels
    begin_s: float
    end_s: float


def gyroscope_ended_s(record: RunRecord) -> float | None:
    """When the gyroscope of a satellite reported for the last time, since the first state [s].

    Returns:
        None where it reported to the end of the run, or never.
    """
    if not record.gyroscope_s or not len(record.motion):
        return None
    last_s, begin_s, end_s = max(record.gyroscope_s), record.motion.stamp_s[0], record.motion.stamp_s[-1]
    return float(last_s - begin_s) if end_s - last_s > SILENT_S else None


def rate_sources(record: RunRecord) -> list[RateSource]:
    """Sources of the turn rate in their order, as the estimator named them; empty where none did.

    Its status comes by the wall clock, which says little in lock step: a gyroscope that fell silent was left then.
    """
    motion, died_s = record.motion, gyroscope_ended_s(record)
    if not len(motion):
        return []
    begin_s, log_s = float(motion.stamp_s[0]), np.maximum.accumulate(motion.log_s)
    found: list[RateSource] = []
    for each in record.health:
        name = each.values.get("rate_from", "")
        if not name or each.values.get("published") == "0" or (found and found[-1].name == name):
            continue
        time_s = float(np.interp(each.log_s, log_s, motion.stamp_s)) - begin_s
        if found and found[-1].name == GYROSCOPE and died_s is not None:
            time_s = min(time_s, max(died_s, found[-1].begin_s))
        found.append(RateSource(name, time_s if found else 0.0, float(motion.stamp_s[-1]) - begin_s))
    ends = [each.begin_s for each in found[1:]]
    return [replace(each, end_s=end_s) for each, end_s in zip(found, ends, strict=False)] + found[-1:]
