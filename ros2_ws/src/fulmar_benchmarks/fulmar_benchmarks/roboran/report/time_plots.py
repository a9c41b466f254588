"""Errors, waypoints and velocities over time, and learning curves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from fulmar_benchmarks.roboran.report.view import View, panels
from fulmar_benchmarks.roboran.targets import LEAST, thesis_row
from fulmar_benchmarks.unit import CONTROL_HZ, GOAL_STEPS
from fulmar_core.states.planar import to_body, wrapped
from fulmar_evaluation.report.drawing import LENGTHS, bands, limit_line, log_scale, ring
from fulmar_evaluation.report.style import DASHED, FAINT, INK, quiet_grid

EPISODE = 0  # whose velocities are drawn


def draw_errors_over_time(runs: Sequence[View]) -> Figure:
    """Distance from the goal, or length of the velocity error, against the tolerance."""
    figure, axes = panels(runs, 2.9, sharey=True)
    for one, run in zip(axes[0], runs, strict=True):
        _band(one, run)
        tolerance = run.task.tolerance
        limit = tolerance.position or tolerance.velocity
        limit_line(one, limit)
        end = run.dt * run.main.over_time.shape[1]
        one.axvspan(end - tolerance.hold_s, end, color=FAINT, alpha=0.12, linewidth=0)
        one.set_xlim(0.0, end)
        if tolerance.position:
            log_scale(one.yaxis, LENGTHS)
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
            top = (episode_s, float(np.mean(most)))
            one.plot(*top, "v", color=INK, markersize=6, zorder=6)
            one.annotate("bound", top, (-6, 3), textcoords="offset points", ha="right", fontsize=8.5)
        thesis = thesis_row(run.entry["robot"], run.entry["task"])
        if thesis.goals is not None:
            theirs = (GOAL_STEPS / CONTROL_HZ, thesis.goals)
            one.plot(*theirs, **ring(markersize=6, zorder=6))
            one.annotate("thesis", theirs, (4, -12), textcoords="offset points", ha="center", fontsize=8.5)
        one.axvline(episode_s, color=FAINT, linestyle=DASHED, linewidth=0.8)
        one.set_xlim(0.0, end * 1.04)
        one.set_ylim(bottom=0.0)
        one.yaxis.set_major_locator(MaxNLocator("auto", integer=True))
        one.set_xlabel("time [s]")
    axes[0, 0].set_ylabel("waypoints reached")
    return figure


def _band(axes: Axes, run: View) -> None:
    quantiles = run.main.over_time
    bands(axes, run.dt * np.arange(1, quantiles.shape[1] + 1), quantiles, run.colour)
    quiet_grid(axes)


def draw_velocities(runs: Sequence[View]) -> Figure:
    """Speed ahead, to the left, and turn rate of the first episode of every pair."""
    figure, axes = panels(runs, 5.2, rows=3, sharex=True, sharey="row")
    for column, run in enumerate(runs):
        time_s, wanted, true = _velocities(run)
        tolerance = run.task.tolerance
        widths = (tolerance.velocity, tolerance.velocity, tolerance.yaw_rate_deg)
        for row, (one, width) in enumerate(zip(axes[:, column], widths, strict=True)):
            low, high = wanted[row] - width, wanted[row] + width
            one.fill_between(time_s, low, high, step="pre", color=run.colour, alpha=0.15, lw=0.0)
            one.step(time_s, wanted[row], where="pre", color=INK, linewidth=1.0, linestyle=DASHED)
            one.plot(time_s, true[row], color=run.colour, linewidth=1.2)
            quiet_grid(one)
        axes[-1, column].set_xlabel("time [s]")
        axes[-1, column].set_xlim(0.0, time_s[-1])
    for one, label in zip(axes[:, 0], ("ahead [m/s]", "to the left [m/s]", "turn rate [°/s]"), strict=True):
        one.set_ylabel(label)
    return figure


def _velocities(run: View) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Ends of the steps, wanted and true velocities, shapes (steps,) and (3, steps), turn rates in degrees."""
    outcome = run.main
    way = np.concatenate((outcome.starts[EPISODE, None], outcome.paths[EPISODE]))
    steps = np.diff(way, axis=0)
    turn = wrapped(steps[:, 2])
    ahead, left = to_body(way[:-1, 2] + 0.5 * turn, steps[:, 0], steps[:, 1])
    true = np.stack((ahead, left, np.rad2deg(turn))) / run.dt
    # What is wanted during a step is what counted at its beginning.
    which = np.concatenate(([0.0], outcome.goals[EPISODE, :-1])).astype(int)
    wanted = outcome.targets[EPISODE, which].T.copy()
    wanted[2] = np.rad2deg(wanted[2])
    return run.dt * np.arange(1, len(steps) + 1), wanted, true


def curve_of(run: View) -> list[dict[str, Any]]:
    """Learning curve of a pair, from its passport: evaluations on held-out episodes, oldest first."""
    curve = run.training.get("curve")
    return curve if isinstance(curve, list) and len(curve) > 1 else []


def draw_curves(runs: Sequence[View]) -> Figure:
    """Success on held-out episodes over wall-clock."""
    figure, axes = panels(runs, 2.9, sharey=True)
    for one, run in zip(axes[0], runs, strict=True):
        curve = curve_of(run)
        wall_s = np.array([point["wall_s"] for point in curve])
        success = 100.0 * np.array([point["success_rate"] for point in curve])
        one.plot(wall_s, success, color=run.colour, linewidth=1.4, marker="o", markersize=2.4)
        least = LEAST.get(run.entry["task"], {}).get(run.entry["robot"])
        if least is not None and run.entry["judged_figure"] == "success_rate":
            limit_line(one, 100.0 * least)
        one.set_xlim(left=0.0)
        one.set_ylim(-2.0, 102.0)
        one.set_xlabel("wall-clock of training [s]")
        quiet_grid(one)
    axes[0, 0].set_ylabel("success when evaluated [%]")
    return figure
