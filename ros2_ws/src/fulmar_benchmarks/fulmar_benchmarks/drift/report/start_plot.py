"""The same starts with every controller: the ways, and the errors below them (thesis Figure 3.14)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from fulmar_benchmarks.drift.report.time_plot import LIMITS, key
from fulmar_benchmarks.drift.report.view import WIDTH, View
from fulmar_core.planar import wrapped
from fulmar_evaluation.report.error_plot import ANGLES, LENGTHS
from fulmar_evaluation.report.style import DASHED, INK, PAPER, quiet_grid

STARTS = (0, 1)  # numbers of episodes
OUTLINE_EVERY_S = 8.0
RADIUS = 0.31  # of the platform [m]
HALF = 2.7  # half width of a panel: starts are at most 4 m away [m]


def draw_starts(by_row: dict[str, list[View]], rows: Sequence[str]) -> Figure:
    """Two starts, each in some conditions.

    Args:
        by_row: Every controller of every condition.
        rows: Which conditions to draw.
    """
    columns = [(row, start) for row in rows for start in STARTS if start < len(by_row[row][0].outcome.paths)]
    figure = Figure(figsize=(WIDTH * min(1.0, (len(columns) + 0.5) / 4.5), 6.6), layout="constrained")
    axes = figure.subplots(3, len(columns), squeeze=False, height_ratios=(1.5, 1.0, 1.0))
    for column, (row, start) in zip(axes.T, columns, strict=True):
        runs = by_row[row]
        column[0].set_title(f"{runs[0].title}\nstart {start + 1}", loc="left", fontsize=9)
        for run in runs:
            _way(column[0], run, start)
            distance, heading = errors(run, start)
            column[1].plot(run.time_s, distance, color=run.colour, linewidth=1.2)
            column[2].plot(run.time_s, heading, color=run.colour, linewidth=1.2)
        _place(column[0], [run.outcome.starts[start] - run.outcome.targets[start, 0] for run in runs])
        _logarithmic(column[1], LENGTHS, (1e-3, 8.0), LIMITS["distance_m"])
        _logarithmic(column[2], ANGLES, (0.02, 250.0), LIMITS["heading_error_deg"])
        for one in column[1:]:
            one.set_xlim(0.0, runs[0].time_s[-1])
        column[2].set_xlabel("time [s]")
    for one in axes[1:, 1:].flat:
        one.tick_params(labelleft=False)
    for one, label in zip(
        axes[:, 0], ("y from the goal [m]", "distance to goal", "heading error"), strict=True
    ):
        one.set_ylabel(label)
    figure.legend(handles=key(by_row[row] for row in rows), loc="outside upper left", ncols=6, fontsize=9)
    return figure


def errors(run: View, start: int) -> tuple[np.ndarray, np.ndarray]:
    """Distance [m] and size of the heading error [deg] of one episode, shapes (steps,)."""
    goal = run.outcome.targets[start, 0]
    x, y, yaw = run.outcome.paths[start].T
    return np.hypot(goal[0] - x, goal[1] - y), np.abs(np.rad2deg(wrapped(goal[2] - yaw)))


def _way(axes: Axes, run: View, start: int) -> None:
    outcome = run.outcome
    way = np.concatenate((outcome.starts[start, None], outcome.paths[start])) - outcome.targets[start, 0] * [
        1,
        1,
        0,
    ]
    axes.plot(way[:, 0], way[:, 1], color=run.colour, linewidth=1.3, zorder=4)
    every = max(1, round(OUTLINE_EVERY_S / float(outcome.about["control_dt"])))
    for x, y, yaw in way[: 4 * every : every]:
        axes.add_patch(
            Circle((x, y), RADIUS, facecolor="none", edgecolor=run.colour, linewidth=0.7, alpha=0.6)
        )
        tip = (x + RADIUS * np.cos(yaw), y + RADIUS * np.sin(yaw))
        axes.plot(*zip((x, y), tip, strict=True), color=run.colour, linewidth=0.7, alpha=0.6)


def _place(axes: Axes, starts: Sequence[np.ndarray]) -> None:
    """The goal in the origin, and a square about it and the start."""
    axes.plot(0.0, 0.0, "o", color=INK, markerfacecolor=PAPER, markersize=4.5, zorder=6)
    axes.set_aspect("equal")
    x, y, _ = 0.5 * starts[0]
    axes.set_xlim(x - HALF, x + HALF)
    axes.set_ylim(y - HALF, y + HALF)
    axes.set_xlabel("x from the goal [m]")
    quiet_grid(axes)


def _logarithmic(axes: Axes, ticks: dict[float, str], limits: tuple[float, float], tolerance: float) -> None:
    axes.axhline(tolerance, color=INK, linestyle=DASHED, linewidth=0.9)
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(FixedLocator(list(ticks)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: ticks.get(value, "")))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.set_ylim(*limits)
    quiet_grid(axes)
