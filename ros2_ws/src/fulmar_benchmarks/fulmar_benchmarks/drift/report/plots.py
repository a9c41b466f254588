"""Controllers prepared for drawing; all conditions at a glance, all trajectories over time (thesis Figure 3.5)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fulmar_benchmarks.drift.cells import display_name
from fulmar_benchmarks.drift.document import Key
from fulmar_benchmarks.results import PairResult
from fulmar_evaluation.report.drawing import (
    ANGLES,
    LENGTHS,
    WIDTH,
    bands,
    colour_lines,
    key,
    limit_line,
    log_scale,
    ring,
)
from fulmar_evaluation.report.style import FAINT, INK, colours, quiet_grid


@dataclass(frozen=True)
class View:
    """What one controller did in one row."""

    row: str
    title: str  # of the row
    label: str  # of the controller
    colour: str
    outcome: PairResult

    @property
    def time_s(self) -> np.ndarray:
        """Ends of the control steps, shape (steps,) [s]."""
        return self.outcome.time_s


def views(document: Mapping[str, Any], outcomes: dict[Key, PairResult], kind: str) -> dict[str, list[View]]:
    """By row, every controller that has a result in it."""
    colour = dict(zip(document["controllers"], colours(document["controllers"]), strict=True))
    found = {
        name: [
            View(
                name,
                row["title"],
                display_name(controller),
                colour[controller],
                outcomes[name, controller],
            )
            for controller in document["controllers"]
            if (name, controller) in outcomes
        ]
        for name, row in document["rows"].items()
        if row["kind"] == kind
    }
    return {name: some for name, some in found.items() if some}


LIMITS = {"distance_m": 0.05, "heading_error_deg": 5.0}  # of PT5 and OT5
LABELS = {
    "distance_m": "distance to goal",
    "heading_error_deg": "heading error",
    "speed_m_s": "speed [m/s]",
    "turn_rate_deg_s": "turn rate [°/s]",
}


def draw_row(runs: Sequence[View]) -> Figure:
    """The four quantities of one condition, every controller with its bands."""
    figure = Figure(figsize=(WIDTH, 5.0), layout="constrained")
    axes = figure.subplots(2, 2, sharex=True)
    for one, name in zip(axes.flat, LABELS, strict=True):
        _panel(one, runs, name, wide=True)
        one.set_ylabel(LABELS[name])
    for one in axes[1]:
        one.set_xlabel("time [s]")
    controllers_key(figure, [runs])
    return figure


def draw_rows(by_row: dict[str, list[View]]) -> Figure:
    """The same for every condition, one below the other."""
    figure = Figure(figsize=(WIDTH, 0.7 + 1.25 * len(by_row)), layout="constrained")
    axes = figure.subplots(len(by_row), len(LABELS), sharex=True, sharey="col", squeeze=False)
    for line, runs in zip(axes, by_row.values(), strict=True):
        for one, name in zip(line, LABELS, strict=True):
            _panel(one, runs, name, wide=False)
        line[0].set_title(runs[0].title, loc="left", fontsize=9, fontweight="bold", pad=3.0)
    for one, label in zip(axes[0], LABELS.values(), strict=True):
        one.annotate(
            label, (1.0, 1.0), (0, 3), xycoords="axes fraction", textcoords="offset points",
            ha="right", va="bottom", fontsize=8.5,
        )  # fmt: skip
    for one in axes[-1]:
        one.set_xlabel("time [s]")
    controllers_key(figure, by_row.values())
    return figure


def controllers_key(figure: Figure, rows: Iterable[Sequence[View]]) -> None:
    """A legend with one line for each controller that is drawn anywhere."""
    key(figure, colour_lines({run.label: run.colour for runs in rows for run in runs}))


def _panel(axes: Axes, runs: Sequence[View], name: str, *, wide: bool) -> None:
    for run in runs:
        bands(axes, run.time_s, run.outcome.more[name], run.colour, half=wide)
    if name in LIMITS:
        limit_line(axes, LIMITS[name])
        log_scale(axes.yaxis, LENGTHS if name == "distance_m" else ANGLES)
        axes.set_ylim((2e-3, 8.0) if name == "distance_m" else (0.05, 250.0))
    else:
        axes.set_ylim(bottom=0.0)
    axes.set_xlim(0.0, runs[0].time_s[-1])
    quiet_grid(axes)


SHOWN = ("PT5", "PT2", "PT1", "OT5")
_APART = 0.34  # between the controllers of one row, of the distance of two rows


def draw_glance(document: Mapping[str, Any]) -> Figure | None:
    """One row a condition, one column a figure; None where no condition has a result."""
    rows = {
        name: row
        for name, row in document["rows"].items()
        if row["kind"] == "pose" and any(entry["figures"] for entry in row["controllers"].values())
    }
    if not rows:
        return None
    names = document["controllers"]
    figure = Figure(figsize=(WIDTH, 1.1 + (0.16 + 0.17 * len(names)) * len(rows)), layout="constrained")
    axes = figure.subplots(1, len(SHOWN), sharey=True)
    asked = {
        (check["row"], check["controller"], check["figure"]): check["limit"]
        for check in document["requirements"]
    }
    shade = colours(names)
    for one, shown in zip(axes, SHOWN, strict=True):
        for at, (row, known) in enumerate(rows.items()):
            one.axhspan(at - 0.5, at + 0.5, color=FAINT, alpha=0.09 * (at % 2), linewidth=0)
            if shown in known["bound"]:
                most = known["bound"][shown]["mean"]
                one.plot([most] * 2, [at - 0.45, at + 0.45], color=FAINT, linewidth=1.2)
            for index, (name, colour) in enumerate(zip(names, shade, strict=True)):
                y = at + _APART * (index - 0.5 * (len(names) - 1)) * 2.0 / max(len(names), 2)
                _mark(one, y, known["controllers"][name], shown, colour, asked.get((row, name, shown)))
        one.set_title(f"{shown} [%]", loc="left")
        one.set_xlim(-3.0, 103.0)
        quiet_grid(one)
        one.grid(False, axis="y")
    axes[0].set_yticks(range(len(rows)), [row["title"] for row in rows.values()])
    axes[0].set_ylim(len(rows) - 0.5, -0.5)
    for one in axes:
        one.tick_params(axis="y", length=0.0)
    key(figure, _key(names, shade), most=len(names) + 3)
    return figure


def _mark(axes: Axes, y: float, entry: dict[str, Any], figure: str, colour: str, limit: float | None) -> None:
    axes.plot(entry["published"][figure], y, **ring(colour, markersize=4.5, alpha=0.8))
    if entry["figures"]:
        ours = entry["figures"][figure]
        axes.plot([ours["p5"], ours["p95"]], [y, y], color=colour, linewidth=1.0, alpha=0.35)
        axes.plot(ours["mean"], y, "o", color=colour, markersize=5.0, zorder=5)
    if limit is not None:
        axes.plot(limit, y, "|", color=INK, markersize=9.0, markeredgewidth=1.4, zorder=6)


def _key(names: list[str], shade: list[str]) -> list[Line2D]:
    lines = [
        Line2D([], [], color=colour, marker="o", linestyle="", label=display_name(name))
        for name, colour in zip(names, shade, strict=True)
    ]
    return [
        *lines,
        Line2D([], [], **ring(label="published")),
        Line2D([], [], linestyle="", color=INK, marker="|", markersize=9.0, label="required"),
        Line2D([], [], color=FAINT, label="bound"),
    ]
