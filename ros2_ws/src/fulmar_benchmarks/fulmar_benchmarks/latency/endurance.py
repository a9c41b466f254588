"""Many commands in a row: does a node's memory grow, and is every command in the bag?"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_bags.run_record import read_run
from fulmar_benchmarks.latency.watched_system import STEP_HZ, plan_at, watched_system
from fulmar_benchmarks.shape import ALONE, Benchmark, Cell, Check, Figures, Found, Progress, known

ALLOWED_MB = 5.0
WARM_UP_SHARE = 0.1  # of the time: pools fill and windows of statistics grow to their size
LOOK_S = 5.0


@dataclass(frozen=True, kw_only=True)
class EnduranceCell(Cell):
    """One long run."""

    modules = (f"{__package__}.watched_system",)
    simulated_s: float
    rate: float
    folder: Path  # of the folders of all attempts

    def parts(self) -> dict[str, Any]:
        """Not where bags lie."""
        return {"simulated_s": self.simulated_s, "rate": self.rate}

    def measure(self, progress: Progress, pool: Any = None) -> Figures:
        """As in `endure`, in a folder of its own beside those of earlier attempts."""
        folder = next(path for number in count(1) if not (path := self.folder / f"run_{number}").exists())
        return endure(simulated_s=self.simulated_s, rate=self.rate, folder=folder, progress=progress)


class Endurance(Benchmark):
    """Does memory grow, and is every command in the bag?"""

    name = "endurance"
    title = "A long run"

    def cells(self) -> list[EnduranceCell]:
        """The run."""
        simulated_s, rate = self.choice.simulated_s, self.choice.rate
        return [
            EnduranceCell(
                name=f"{simulated_s:g}_s_at_{rate:g}", cost=simulated_s, where=ALONE, way="ros",
                simulated_s=simulated_s, rate=rate, folder=self.choice.out,
            )
        ]  # fmt: skip

    def document(self, found: Found) -> dict[str, Any]:
        """Its figures."""
        return known(found, self.cells()[0].name)

    def checks(self, document: Mapping[str, Any]) -> list[Check]:
        """No command is lost, no node grows."""
        most = max(document["memory_growth_mb"].values())
        return [
            Check.most("commands that are not in the bag", document["commands_lost"], 0),
            Check("growth of a node's memory [MB]", most, ALLOWED_MB, most < ALLOWED_MB, "less"),
        ]

    def tables(self, document: Mapping[str, Any]) -> list[str]:
        """Commands, and memory of each node."""
        head = (
            f"{document['simulated_s']:g} s at {document['rate']:g} times real time: {document['commands_lost']} of "
            f"{document['commands_answered']} commands are not in the bag"
        )
        nodes = [
            f"{name}: {document['memory_mb'][name]:.0f} MB, grown by {grown:.1f} MB"
            for name, grown in document["memory_growth_mb"].items()
        ]
        return [head, *nodes, *self.check_lines(document)]


def endure(
    *, simulated_s: float, rate: float, folder: Path, progress: Callable[[float], None]
) -> dict[str, Any]:
    """Run a system for long.

    Args:
        simulated_s: How long, in the robot's own time [s].
        rate: Seconds of it a second of the wall clock.
        folder: Where policy and bag come; must not exist.
        progress: Called with how much is over [s].

    Returns:
        Figures by name, ready for JSON.

    Raises:
        RunFailed: A node ended, or did not get ready.
    """
    plan = plan_at(rate * STEP_HZ, folder)
    seconds = simulated_s / rate
    seen: list[tuple[float, dict[str, int]]] = []
    with watched_system(plan, {}) as system:
        began_s = time.monotonic()
        while (passed_s := time.monotonic() - began_s) < seconds:
            seen.append((passed_s, system.memory_bytes()))
            progress(rate * passed_s)
            system.wait(min(LOOK_S, seconds - passed_s))
        seen.append((time.monotonic() - began_s, system.memory_bytes()))
        plant, controller = system.reports()
        system.end_commands()
        answered = int(system.reports()[0]["answers"])
    growth = _growth_mb(seen, WARM_UP_SHARE * seconds)
    recorded = _recorded(Path(plan.record))
    lost = max(0, answered - recorded)
    return {
        "simulated_s": simulated_s,
        "rate": rate,
        "commands_answered": answered,
        "commands_in_the_bag": recorded,
        "commands_lost": lost,
        "memory_growth_mb": growth,
        "allowed_mb": ALLOWED_MB,
        "memory_mb": {name: size / 1e6 for name, size in seen[-1][1].items()},
        "watchdog_trips": int(plant["watchdog_trips"]),
        "overruns": int(plant["overruns"]) + int(controller["overruns"]),
        "passed": lost == 0 and max(growth.values()) < ALLOWED_MB,
    }


def _growth_mb(seen: list[tuple[float, dict[str, int]]], from_s: float) -> dict[str, float]:
    """By how much the most memory since then exceeds what there was then [MB]."""
    warm = [sizes for passed_s, sizes in seen if passed_s >= from_s]
    return {name: (max(sizes[name] for sizes in warm) - warm[0][name]) / 1e6 for name in warm[0]}


def _recorded(bag: Path) -> int:
    """Different states that commands in a bag answer."""
    record = read_run(bag)
    return len(np.intersect1d(record.commanded.stamp_s, record.odom.stamp_s))
