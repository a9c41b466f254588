"""One rate, one load, one executor: how late commands come, and what the nodes use."""

from __future__ import annotations

import contextlib
import itertools
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from fulmar_benchmarks.latency.watched_system import REPORT_S, plan_at, watched_system
from fulmar_core.config.errors import RunFailed
from fulmar_ros.runtime import EXECUTOR

RATES_HZ = (5.0, 10.0, 20.0, 50.0, 100.0, 200.0)
REQUIRED_HZ, REQUIRED_P99_MS = 50.0, 3.0


@dataclass(frozen=True)
class Cell:
    """What is measured together."""

    hz: float  # steps and commands a second
    loaded: bool  # every core has a busy process of ordinary priority besides
    executor: str  # events, or default: that of rclpy


def cells_of(rates_hz: tuple[float, ...], executors: tuple[str, ...]) -> list[Cell]:
    """Every combination, the idle ones first."""
    return [
        Cell(hz, loaded, executor)
        for loaded, executor, hz in itertools.product((False, True), executors, rates_hz)
    ]


def measure(cells: list[Cell], seconds: float, progress: Callable[[int], None]) -> dict[str, Any]:
    """Measure cell by cell.

    Args:
        cells: Which.
        seconds: Of each, after it has begun to act [s].
        progress: Called with how many are over.

    Returns:
        Figures by name, ready for JSON.
    """
    rows = []
    for count, cell in enumerate(cells, 1):
        with tempfile.TemporaryDirectory(prefix="fulmar_", ignore_cleanup_errors=True) as folder:
            rows.append(asdict(cell) | _row(cell, seconds, Path(folder)))
        progress(count)
    required = _required(rows)
    return {
        "seconds": seconds,
        "cores": len(os.sched_getaffinity(0)),
        "cells": rows,
        "required": required,
        "passed": all(line["passed"] for line in required),
    }


def _row(cell: Cell, seconds: float, folder: Path) -> dict[str, Any]:
    try:
        with watched_system(plan_at(cell.hz, folder), {EXECUTOR: cell.executor}) as system, _load(cell):
            began_s, before = time.monotonic(), system.cpu_s()
            system.wait(seconds + REPORT_S)
            took_s, after = time.monotonic() - began_s, system.cpu_s()
            plant, controller = system.reports()
    except RunFailed as error:
        return {"failure": str(error)}
    return {
        "failure": None,
        "answers": int(plant["answers"]),
        "latency_ms": _spread(plant, "latency_ms"),
        "plant_period_error_ms": _spread(plant, "period_error_ms"),
        "controller_period_error_ms": _spread(controller, "period_error_ms"),
        "inference_ms": _spread(controller, "inference_ms"),
        "overruns": int(plant["overruns"]) + int(controller["overruns"]),
        "watchdog_trips": int(plant["watchdog_trips"]),
        "cpu_share": {name: (after[name] - before[name]) / took_s for name in before},
    }


def _spread(report: Any, name: str) -> dict[str, float | None]:
    texts = {key: report.get(f"{name}_{key}", "") for key in ("p50", "p99", "max")}
    return {key: float(text) if text else None for key, text in texts.items()}


@contextlib.contextmanager
def _load(cell: Cell) -> Iterator[None]:
    """A process that never rests for each core, if the cell has them."""
    count = len(os.sched_getaffinity(0)) if cell.loaded else 0
    busy = [
        subprocess.Popen([sys.executable, "-c", "while True: pass"], stdin=subprocess.DEVNULL)
        for _ in range(count)
    ]
    try:
        yield
    finally:
        for process in busy:
            process.kill()
        for process in busy:
            process.wait()


def _required(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Requirements for the executor that Fulmar runs with, at 50 Hz."""
    lines = []
    limit: float
    for row in rows:
        if row["hz"] != REQUIRED_HZ or row["executor"] != "events":
            continue
        if row["loaded"]:
            value, limit, what = row.get("watchdog_trips"), 0, "watchdog trips under full load"
            passed = value == 0
        else:
            value = (row.get("latency_ms") or {}).get("p99")
            limit, what = REQUIRED_P99_MS, "latency p99 when idle [ms]"
            passed = value is not None and value < limit
        lines.append({"what": what, "limit": limit, "value": value, "passed": passed})
    return lines
