"""What all episodes of a pair do over time: the middle one, and how far they spread."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullLocator

from fulmar_benchmarks.roboran.report.view import View, panels
from fulmar_benchmarks.roboran.targets import CONTROL_HZ, GOAL_STEPS, thesis_row
from fulmar_evaluation.report.error_plot import LENGTHS
from fulmar_evaluation.report.style import DASHED, FAINT, INK, quiet_grid


def draw_errors_over_time(runs: Sequence[View]) -> Figure:
    """Distance from the goal, or length of the velocity error, against the tolerance."""
    figure, axes = panels(runs, 2.9, sharey=True)
    for one, run in zip(axes[0], runs, strict=True):
        _band(one, run)
        tolerance = run.task.tolerance
        limit = tolerance.position or tolerance.velocity
        one.axhline(limit, color=INK, linestyle=DASHED, linewidth=1.0)
        end = run.dt * run.main.over_time.shape[1]
        one.axvspan(end - tolerance.hold_s, end, color=FAINT, alpha=0.12, linewidth=0)
        one.set_xlim(0.0, end)
        if tolerance.position:
            one.set_yscale("log")
            one.yaxis.set_major_locator(FixedLocator(list(LENGTHS)))
            one.yaxis.set_major_formatter(FuncFormatter(lambda value, _: LENGTHS.get(value, "")))
            one.yaxis.set_minor_locator(NullLocator())
            one.set_ylim(2e-3, 12.0)
        else:
            one.set_ylim(bottom=0.0)
        one.set_xlabel("time [s]")
    axes[0, 0].set_ylabel("distance to goal" if runs[0].task.tolerance.position else "velocity error [m/s]")
    return figure


def draw_goals_over_time(runs: Sequence[View]) -> Figure:
    """Waypoints reached, against the bound and what the thesis counts."""
    figure, axes = panels(runs, 3.1)
    for one, run in zip(axes[0], runs, strict=True):
        outcome = run.main
        _band(one, run)
        episode_s, end = outcome.about["episode_s"], run.dt * outcome.over_time.shape[1]
        most = outcome.figures.get("goals_bound")
        if most is not None:
            one.plot(episode_s, np.mean(most), "v", color=INK, markersize=6, zorder=6)
            one.annotate(
                "bound",
                (episode_s, float(np.mean(most))),
                (-6, 3),
                textcoords="offset points",
                ha="right",
                fontsize=8.5,
            )
        thesis = thesis_row(run.entry["robot"], run.entry["task"])
        if thesis.goals is not None:
            at = GOAL_STEPS / CONTROL_HZ
            one.plot(at, thesis.goals, "o", color=INK, markerfacecolor="none", markersize=6, zorder=6)
            one.annotate(
                "thesis", (at, thesis.goals), (4, -12), textcoords="offset points", ha="center", fontsize=8.5
            )
        one.axvline(episode_s, color=FAINT, linestyle=DASHED, linewidth=0.8)
        one.set_xlim(0.0, end * 1.04)
        one.set_ylim(bottom=0.0)
        one.yaxis.set_major_locator(MaxNLocator("auto", integer=True))
        one.set_xlabel("time [s]")
    axes[0, 0].set_ylabel("waypoints reached")
    return figure


def _band(axes: Axes, run: View) -> None:
    low, lower, middle, upper, high = run.main.over_time
    time_s = run.dt * np.arange(1, len(middle) + 1)
    axes.fill_between(time_s, low, high, color=run.colour, alpha=0.13, linewidth=0)
    axes.fill_between(time_s, lower, upper, color=run.colour, alpha=0.22, linewidth=0)
    axes.plot(time_s, middle, color=run.colour)
    quiet_grid(axes)
