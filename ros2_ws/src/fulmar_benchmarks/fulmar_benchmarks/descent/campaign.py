"""The whole benchmark: flights at every height, in the batch, through ROS in lock step, and in real time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from fulmar_benchmarks.descent.flights import MOST_BANK_DEG, MOST_SINK, SHARE, Descent, Flights
from fulmar_benchmarks.workers import mapped
from fulmar_bringup.console import log_line

BATCH, LOCKSTEP, REAL_TIME = WAYS = ("batch", "lockstep", "realtime")
Progress = Callable[[float, float], None]


@dataclass(frozen=True)
class Request:
    """What to fly."""

    flights: tuple[Flights, ...]  # of each height
    ways: tuple[str, ...]  # out of WAYS
    real_time: int  # flights in real time at each height
    jobs: int  # flights in lock step at once


def run_descents(request: Request, progress: Progress) -> dict[str, Any]:
    """Fly everything; figures by height and way, ready for JSON.

    Raises:
        FulmarError: A robot that does not fly, or no such controller.
    """
    heights = []
    for done, flights in enumerate(request.flights):
        row: dict[str, Any] = {"height_m": flights.height}
        for part, way in enumerate(request.ways):

            def moved(now: float, total: float, whole: float = done + part / len(request.ways)) -> None:
                progress(whole + now / max(total, 1.0) / len(request.ways), float(len(request.flights)))

            row[way] = summary(_fly(flights, way, request, moved))
            log_line(words(row, way))  # an interrupted benchmark has said what it knows
        heights.append(row)
    first = request.flights[0]
    rows = requirements(heights)
    return {
        "robot": first.robot,
        "controller": first.controller,
        "scenario": first.scenario,
        "seed": first.seed,
        "heights": heights,
        "required": rows,
        "passed": all(row["passed"] for row in rows),
    }


def _fly(flights: Flights, way: str, request: Request, progress: Progress) -> list[Descent | str]:
    if way == BATCH:
        from fulmar_benchmarks.descent.batch import fly_in_batch

        return list(fly_in_batch(flights))
    count, jobs = (request.real_time, 1) if way == REAL_TIME else (flights.count, request.jobs)
    items = [(flights, number, way) for number in range(count)]
    return mapped(_flown, items, jobs=max(1, min(jobs, count)), progress=progress)


def _flown(flights: Flights, number: int, way: str) -> Descent | str:
    """One flight through ROS, in a process of a pool; a sentence where it could not be flown."""
    from fulmar_benchmarks.descent.live import fly_in_lockstep, fly_in_real_time

    try:
        return (fly_in_lockstep if way == LOCKSTEP else fly_in_real_time)(flights, number)
    except Exception as error:  # noqa: BLE001 - one flight that cannot be flown must not cost the others
        return f"flight {number}: {type(error).__name__}: {error}"


def summary(found: Sequence[Descent | str]) -> dict[str, Any]:
    """Figures of some flights; those that could not be flown count as bad ones."""
    flown = [each for each in found if isinstance(each, Descent)]
    sinks = [each.sink_m_s for each in flown if each.sink_m_s is not None]
    return {
        "flights": len(found),
        "good": sum(each.good for each in flown),
        "touched_down": len(sinks),
        "bank_max_deg": max((each.bank_deg for each in flown), default=None),
        "sink_max_m_s": max(sinks, default=None),
        "sink_median_m_s": float(np.median(sinks)) if sinks else None,
        "seconds_median": float(np.median([each.seconds for each in flown])) if flown else None,
        "not_flown": [each for each in found if isinstance(each, str)],
        "each": [asdict(each) for each in flown],
    }


def words(row: dict[str, Any], way: str) -> str:
    """Figures of one height and way, in a line."""
    found = row[way]
    return (
        f"{way:8} {row['height_m']:g} m: {found['good']} of {found['flights']} good, bank at most "
        f"{written(found['bank_max_deg'])} deg, sink at touch-down {written(found['sink_median_m_s'])} m/s, at most "
        f"{written(found['sink_max_m_s'])} m/s"
    )


def written(value: float | None) -> str:
    """A number, or a dash."""
    return "-" if value is None else f"{value:.2f}"


def requirements(heights: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """What is required at every height in every way, and whether it is met."""
    return [
        {
            "what": f"{way}, killed at {row['height_m']:g} m: bank <= {MOST_BANK_DEG:g} deg, sink <= {MOST_SINK:g} m/s",
            "flights": row[way]["flights"],
            "good": row[way]["good"],
            "limit": SHARE,
            "passed": row[way]["flights"] > 0 and row[way]["good"] >= SHARE * row[way]["flights"],
        }
        for row in heights
        for way in WAYS
        if way in row
    ]
