"""All trajectories over time: median and spread (thesis Figure 3.5)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fulmar_benchmarks.drift.report.view import View
from fulmar_evaluation.report.drawing import (
    ANGLES,
    LENGTHS,
    WIDTH,
    bands,
    colour_lines,
    key,
    limit_line,
    log_scale,
)
from fulmar_evaluation.report.style import quiet_grid

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
