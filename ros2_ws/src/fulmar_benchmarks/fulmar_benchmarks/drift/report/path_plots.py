"""Paths seen from above and errors over time: the same starts, and followed paths (thesis Figures 3.14 and 3.15)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fulmar_benchmarks.drift.conditions import ROBOT, RUN_UP_S
from fulmar_benchmarks.drift.report.plots import LIMITS, View, controllers_key
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.planar import wrapped
from fulmar_core.tasks.goal_files import FollowedPath, load_goals
from fulmar_evaluation.report.drawing import ANGLES, LENGTHS, WIDTH, columns, draw_body, limit_line, log_scale
from fulmar_evaluation.report.style import DASHED, FAINT, INK, PAPER, quiet_grid

STARTS = (0, 1)  # numbers of episodes
OUTLINE_EVERY_S = 8.0
HALF = 2.7  # half width of a panel: starts are at most 4 m away [m]
EPISODE = 0  # of a path that is drawn


def draw_starts(by_row: dict[str, list[View]], rows: Sequence[str]) -> Figure:
    """Two starts, each in some conditions."""
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
    controllers_key(figure, [by_row[row] for row in rows])
    return figure


def errors(run: View, start: int) -> tuple[np.ndarray, np.ndarray]:
    """Distance [m] and size of the heading error [deg] of one episode, shapes (steps,)."""
    goal = run.outcome.targets[start, 0]
    x, y, yaw = run.outcome.paths[start].T
    return np.hypot(goal[0] - x, goal[1] - y), np.abs(np.rad2deg(wrapped(goal[2] - yaw)))


def _way(axes: Axes, run: View, start: int) -> None:
    outcome = run.outcome
    way = np.concatenate((outcome.starts[start, None], outcome.paths[start]))
    way = way - outcome.targets[start, 0] * [1, 1, 0]
    axes.plot(way[:, 0], way[:, 1], color=run.colour, linewidth=1.3, zorder=4)
    every = max(1, round(OUTLINE_EVERY_S / float(outcome.about["control_dt"])))
    for pose in way[: 4 * every : every]:
        draw_body(axes, pose, load_robot(ROBOT).body, run.colour)


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
    limit_line(axes, tolerance)
    log_scale(axes.yaxis, ticks)
    axes.set_ylim(*limits)
    quiet_grid(axes)


def draw_paths(by_row: dict[str, list[View]]) -> Figure:
    """One column a path: the first run of every controller."""
    figure, axes = columns(len(by_row), 6.8, rows=3, height_ratios=(1.7, 1.0, 1.0))
    for column, runs in zip(axes.T, by_row.values(), strict=True):
        above, velocity, off = column
        file = load_goals(runs[0].outcome.about["goals"])
        assert isinstance(file, FollowedPath)
        points = file.planner().points
        loop = np.concatenate((points, points[:1]))
        above.plot(*loop.T, color=INK, linestyle=DASHED, linewidth=1.0, zorder=5)
        for run in runs:
            outcome, look = run.outcome, {"color": run.colour, "linewidth": 0.9}
            way = np.concatenate((outcome.starts[EPISODE, None], outcome.paths[EPISODE]))
            above.plot(way[:, 0], way[:, 1], color=run.colour, linewidth=1.2)
            velocity.plot(run.time_s, outcome.more["velocity_error_m_s"][EPISODE], **look)
            off.plot(run.time_s, 100.0 * outcome.more["path_error_m"][EPISODE], **look)
        above.plot(*runs[0].outcome.starts[EPISODE, :2], "o", color=INK, markersize=4.0, zorder=6)
        above.set_title(runs[0].title, loc="left", fontweight="bold")
        above.set_aspect("equal")
        above.set_xlim(-1.95, 1.95)
        above.set_ylim(-1.95, 1.95)
        above.set_xlabel("x [m]")
        for one in (velocity, off):
            one.axvspan(0.0, RUN_UP_S, color=FAINT, alpha=0.15, linewidth=0)
            one.set_xlim(0.0, runs[0].time_s[-1])
        off.set_xlabel("time [s]")
        off.set_ylim(0.0, off.get_ylim()[1])
        for one in column:
            quiet_grid(one)
    fastest = max(one.get_ylim()[1] for one in axes[1])
    for one in axes[1]:
        one.set_ylim(0.0, fastest)
    for one, label in zip(axes[:, 0], ("y [m]", "velocity error [m/s]", "off the path [cm]"), strict=True):
        one.set_ylabel(label)
    controllers_key(figure, by_row.values())
    return figure
