"""The whole benchmark: flights at every height, in the batch, through ROS in lock step, and in real time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from fulmar_benchmarks.descent.flights import MOST_BANK_DEG, MOST_SINK, SHARE, TASK, Descent, Flights
from fulmar_benchmarks.pairs import policy_hash
from fulmar_benchmarks.shape import ALONE, POOL, Benchmark, Cell, Check, Choice, Figures, Found, Progress
from fulmar_benchmarks.tables import number

BATCH, LOCKSTEP, REAL_TIME = WAYS = ("batch", "lockstep", "realtime")


@dataclass(frozen=True, kw_only=True)
class DescentCell(Cell):
    """Flights of one height in the batch, or one of them through ROS."""

    modules = tuple(f"{__package__}.{name}" for name in ("batch", "flights", "live"))
    flights: Flights
    through: str  # one of WAYS
    number: int = -1  # of the flight; -1: all of them

    def parts(self) -> dict[str, Any]:
        """A bundle counts by what is in it; through ROS how many fly besides does not count."""
        its = self.flights
        policy, count = policy_hash(its.robot, TASK, its.controller, its.policy), max(self.number, its.count)
        flights = asdict(replace(its, policy=policy, count=count if self.number < 0 else 0))
        return {"flights": flights, "through": self.through, "number": self.number}

    def measure(self, progress: Progress, pool: Any = None) -> Figures:
        """Each flight as `Descent`."""
        if self.through == BATCH:
            from fulmar_benchmarks.descent.batch import fly_in_batch

            return {"flown": [asdict(each) for each in fly_in_batch(self.flights)]}
        from fulmar_benchmarks.descent.live import fly_in_lockstep, fly_in_real_time

        fly = fly_in_lockstep if self.through == LOCKSTEP else fly_in_real_time
        return {"flown": [asdict(fly(self.flights, self.number))]}


class Descents(Benchmark):
    """Flights at every height, in the batch, through ROS in lock step, and in real time."""

    name = "descent"
    title = "Aircraft whose controller is killed"

    def __init__(self, choice: Choice) -> None:
        """Flights of each height."""
        super().__init__(choice)
        folder = str(choice.policy.absolute()) if choice.policy else ""
        self._flights = [
            Flights(
                choice.robot, choice.controller, height, choice.flights, choice.seed, choice.scenario, folder
            )
            for height in choice.heights
        ]

    def check(self) -> None:
        """Refuse what cannot be flown."""
        for flights in self._flights:
            flights.check()

    def cells(self) -> list[DescentCell]:
        """Every height in every way."""
        return [
            cell
            for flights in self._flights
            for way in self.choice.through
            for cell in self._of(flights, way)
        ]

    def _of(self, flights: Flights, way: str) -> list[DescentCell]:
        name = f"{flights.robot}_{flights.controller}_{flights.height:g}_m_{way}"
        if way == BATCH:
            return [DescentCell(name=name, flights=flights, through=way)]
        count, where = (self.choice.real_time, ALONE) if way == REAL_TIME else (flights.count, POOL)
        return [
            DescentCell(
                name=f"{name}_{number}", where=where, way="ros", flights=flights, through=way, number=number
            )
            for number in range(count)
        ]

    def document(self, found: Found) -> dict[str, Any]:
        """Figures by height and way."""
        heights = [
            {"height_m": flights.height}
            | {way: summary(_descents(self._of(flights, way), found)) for way in self.choice.through}
            for flights in self._flights
        ]
        rows = requirements(heights)
        return {
            **{key: getattr(self.choice, key) for key in ("robot", "controller", "scenario", "seed")},
            "heights": heights,
            "required": rows,
            "passed": all(row["passed"] for row in rows),
        }

    def checks(self, document: Mapping[str, Any]) -> list[Check]:
        """Shares of good flights."""
        return [
            Check(
                row["what"],
                row["good"] / row["flights"] if row["flights"] else None,
                row["limit"],
                row["passed"],
            )
            for row in document["required"]
        ]

    def tables(self, document: Mapping[str, Any]) -> list[str]:
        """Every flight, then the figures of each height and way, then what is required."""
        return [*lines(document), *self.check_lines(document)]

    def said(self, cell: Cell, figures: Figures) -> str:
        """How many flights were good."""
        good = sum(Descent(**each).good for each in figures["flown"])
        return f"{good} of {len(figures['flown'])} good"


def _descents(cells: Sequence[DescentCell], found: Found) -> list[Descent | str]:
    """What came of each flight; a sentence where it could not be flown."""
    flown: list[Descent | str] = []
    for cell in cells:
        each = found[cell.name]
        if isinstance(each, str):
            flown.append(f"flight {cell.number}: {each}")
        else:
            flown += [Descent(**one) for one in each["flown"]]
    return flown


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


def words(row: Mapping[str, Any], way: str) -> str:
    """Figures of one height and way, in a line."""
    found = row[way]
    bank, median, most = (
        number(found[key], 2, "-") for key in ("bank_max_deg", "sink_median_m_s", "sink_max_m_s")
    )
    return (
        f"{way:8} {row['height_m']:g} m: {found['good']} of {found['flights']} good, bank at most {bank} deg, sink at "
        f"touch-down {median} m/s, at most {most} m/s"
    )


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


def lines(document: Mapping[str, Any]) -> list[str]:
    """Every flight, then the figures of each height and way."""
    found = [
        f"{document['robot']} by {document['controller']}, {document['scenario']}, seed {document['seed']}"
    ]
    for row in document["heights"]:
        for way in (way for way in WAYS if way in row):
            found += [
                f"  {way:8} {row['height_m']:g} m, flight {each['number']:3}: bank {each['bank_deg']:5.2f} deg, "
                f"sink {number(each['sink_m_s'], 2, '-')} m/s after {each['seconds']:.1f} s"
                for each in row[way]["each"]
            ]
            found += [f"  {way:8} {row['height_m']:g} m, {sentence}" for sentence in row[way]["not_flown"]]
    return found + [words(row, way) for row in document["heights"] for way in WAYS if way in row]
