"""Many commands in a row: does a node's memory grow, and is every command in the bag?"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_bags.run_record import read_run
from fulmar_benchmarks.latency.watched_system import STEP_HZ, plan_at, watched_system

ALLOWED_MB = 5.0
WARM_UP_SHARE = 0.1  # of the time: pools fill and windows of statistics grow to their size
LOOK_S = 5.0


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
