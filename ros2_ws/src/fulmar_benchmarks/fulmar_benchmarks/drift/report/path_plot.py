"""Paths followed by velocities: seen from above, and the errors over time (thesis Figure 3.15)."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from fulmar_benchmarks.drift.conditions import RUN_UP_S
from fulmar_benchmarks.drift.report.time_plot import key
from fulmar_benchmarks.drift.report.view import WIDTH, View
from fulmar_core.goal_files import FollowedPath, load_goals
from fulmar_evaluation.report.style import DASHED, FAINT, INK, quiet_grid

EPISODE = 0


def draw_paths(by_row: dict[str, list[View]]) -> Figure:
    """One column a path: the first run of every controller."""
    count = len(by_row)
    figure = Figure(figsize=(WIDTH * min(1.0, (count + 0.4) / 3.4), 6.8), layout="constrained")
    axes = figure.subplots(3, count, squeeze=False, height_ratios=(1.7, 1.0, 1.0))
    for column, runs in zip(axes.T, by_row.values(), strict=True):
        above, velocity, off = column
        file = load_goals(runs[0].outcome.about["goals"])
        assert isinstance(file, FollowedPath)
        points = file.planner().points
        above.plot(
            *np.concatenate((points, points[:1])).T, color=INK, linestyle=DASHED, linewidth=1.0, zorder=5
        )
        for run in runs:
            way = np.concatenate((run.outcome.starts[EPISODE, None], run.outcome.paths[EPISODE]))
            above.plot(way[:, 0], way[:, 1], color=run.colour, linewidth=1.2)
            velocity.plot(
                run.time_s, run.outcome.more["velocity_error_m_s"][EPISODE], color=run.colour, linewidth=0.9
            )
            off.plot(
                run.time_s, 100.0 * run.outcome.more["path_error_m"][EPISODE], color=run.colour, linewidth=0.9
            )
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
    figure.legend(handles=key(by_row.values()), loc="outside upper left", ncols=6, fontsize=9)
    return figure
