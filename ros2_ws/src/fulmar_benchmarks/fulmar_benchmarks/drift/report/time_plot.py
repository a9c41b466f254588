"""All trajectories over time: the middle one, and how far they spread (thesis Figure 3.5)."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from fulmar_benchmarks.drift.report.view import WIDTH, View
from fulmar_evaluation.report.error_plot import ANGLES, LENGTHS
from fulmar_evaluation.report.style import DASHED, INK, quiet_grid

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
    figure.legend(handles=key([runs]), loc="outside upper left", ncols=len(runs), fontsize=9)
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
    figure.legend(handles=key(by_row.values()), loc="outside upper left", ncols=6, fontsize=9)
    return figure


def key(rows: object) -> list[Line2D]:
    """One line for each controller that is drawn anywhere."""
    named = {run.label: run.colour for runs in rows for run in runs}  # type: ignore[attr-defined]
    return [Line2D([], [], color=colour, label=label) for label, colour in named.items()]


def _panel(axes: Axes, runs: Sequence[View], name: str, *, wide: bool) -> None:
    for run in runs:
        low, lower, middle, upper, high = run.outcome.more[name]
        time_s = run.time_s
        axes.fill_between(time_s, low, high, color=run.colour, alpha=0.13, linewidth=0)
        if wide:
            axes.fill_between(time_s, lower, upper, color=run.colour, alpha=0.22, linewidth=0)
        axes.plot(time_s, middle, color=run.colour, linewidth=1.4 if wide else 1.1)
    if name in LIMITS:
        axes.axhline(LIMITS[name], color=INK, linestyle=DASHED, linewidth=0.9)
        axes.set_yscale("log")
        ticks = LENGTHS if name == "distance_m" else ANGLES
        axes.yaxis.set_major_locator(FixedLocator(list(ticks)))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: ticks.get(value, "")))
        axes.yaxis.set_minor_locator(NullLocator())
        axes.set_ylim((2e-3, 8.0) if name == "distance_m" else (0.05, 250.0))
    else:
        axes.set_ylim(bottom=0.0)
    axes.set_xlim(0.0, runs[0].time_s[-1])
    quiet_grid(axes)
