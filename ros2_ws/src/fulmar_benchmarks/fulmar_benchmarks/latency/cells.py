"""One rate, one load, one executor: how late commands come, and what the nodes use."""

from __future__ import annotations

import contextlib
import itertools
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fulmar_benchmarks.latency.watched_system import REPORT_S, plan_at, watched_system
from fulmar_benchmarks.shape import AGAIN, ALONE, Benchmark, Cell, Check, Figures, Found, Progress, known
from fulmar_benchmarks.tables import Entry, Row, Shown, Table, number
from fulmar_core.config.errors import RunFailed
from fulmar_ros.runtime import EXECUTOR

REQUIRED_HZ, REQUIRED_P99_MS = 50.0, 3.0


@dataclass(frozen=True, kw_only=True)
class LatencyCell(Cell):
    """What is measured together."""

    modules = (f"{__package__}.watched_system",)
    hz: float  # steps and commands a second
    loaded: bool  # every core has a busy process of ordinary priority besides
    executor: str  # events, or default: that of rclpy
    seconds: float = 1.0  # after it has begun to act [s]

    def measure(self, progress: Progress, pool: Any = None) -> Figures:
        """Spreads of latency and periods, and what the nodes use; `failure` where a node ended."""
        with tempfile.TemporaryDirectory(prefix="fulmar_", ignore_cleanup_errors=True) as folder:
            its = {"hz": self.hz, "loaded": self.loaded, "executor": self.executor}
            return its | _row(self, self.seconds, Path(folder))


def latency_cell(hz: float, loaded: bool, executor: str, seconds: float) -> LatencyCell:
    """A cell with its name, which needs the whole computer."""
    return LatencyCell(
        name=f"{executor}_{hz:g}_hz_{'loaded' if loaded else 'idle'}", where=ALONE, way="ros", hz=hz, loaded=loaded,
        executor=executor, seconds=seconds,
    )  # fmt: skip


class Latency(Benchmark):
    """How late commands come at several rates."""

    name = "latency"
    title = "From state to command"
    width = 150

    def cells(self) -> list[LatencyCell]:
        """Every combination, the idle ones first."""
        each = itertools.product((False, True), self.choice.executors, self.choice.rates)
        return [latency_cell(hz, loaded, executor, self.choice.seconds) for loaded, executor, hz in each]

    def document(self, found: Found) -> dict[str, Any]:
        """Figures by cell."""
        rows = [known(found, cell.name) for cell in self.cells()]
        required = _required(rows)
        return {
            "seconds": self.choice.seconds,
            "cores": len(os.sched_getaffinity(0)),
            "cells": rows,
            "required": required,
            "passed": all(line["passed"] for line in required),
        }

    def checks(self, document: Mapping[str, Any]) -> list[Check]:
        """At 50 Hz."""
        return [
            Check(row["what"], row["value"], row["limit"], row["passed"], "less")
            for row in document["required"]
        ]

    def tables(self, document: Mapping[str, Any]) -> list[Shown]:
        """A row for each cell."""
        title = f"from state to command, {document['seconds']:g} s each, {document['cores']} cores"
        rows = [Row(tuple(map(Entry, _written(row)))) for row in document["cells"]]
        return [Table(title, HEADS, rows, words=2), *self.check_lines(document)]

    def said(self, cell: Cell, figures: Figures) -> str:
        """Its latency."""
        return figures["failure"] or f"p99 {number(figures['latency_ms']['p99'], 2, '-')} ms"


NODES = ("plant", "controller", "recorder")
HEADS = (
    "load", "executor", "Hz", "p50 ms", "p99 ms", "max ms", "period p99 ms", "trips", "CPU %: plant", "controller",
    "recorder",
)  # fmt: skip


def _written(row: Mapping[str, Any]) -> list[str]:
    head = ["full" if row["loaded"] else "idle", row["executor"], f"{row['hz']:g}"]
    if row["failure"]:
        return [*head, row["failure"], *[""] * 7]
    numbers = [
        *(row["latency_ms"][key] for key in ("p50", "p99", "max")),
        row["controller_period_error_ms"]["p99"],
    ]
    shares = [f"{100.0 * row['cpu_share'][name]:.0f}" for name in NODES]
    return [*head, *(number(each, 2, "-") for each in numbers), str(row["watchdog_trips"]), *shares]


def _row(cell: LatencyCell, seconds: float, folder: Path) -> dict[str, Any]:
    try:
        with watched_system(plan_at(cell.hz, folder), {EXECUTOR: cell.executor}) as system, _load(cell):
            began_s, before = time.monotonic(), system.cpu_s()
            system.wait(seconds + REPORT_S)
            took_s, after = time.monotonic() - began_s, system.cpu_s()
            plant, controller = system.reports()
    except RunFailed as error:
        return {"failure": str(error), AGAIN: True}
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
def _load(cell: LatencyCell) -> Iterator[None]:
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
