"""Ways to a place, seen from above, with the goal in the middle."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from fulmar_benchmarks.roboran.report.view import View, panels, told
from fulmar_evaluation.report.style import ALARM, INK, PAPER, quiet_grid

HALF = 5.6  # half width of a panel [m]


def draw_paths(runs: Sequence[View]) -> Figure:
    """The first episodes of every pair, moved so that all goals coincide; where a heading counts, turned too."""
    figure, axes = panels(runs, 3.6, lines=1, sharex=True, sharey=True)
    for one, run in zip(axes[0], runs, strict=True):
        outcome = run.main
        ways = _about_the_goal(run)
        reached = outcome.succeeded[: len(ways)]
        for way, well in zip(ways, reached, strict=True):
            colour = run.colour if well else ALARM
            one.plot(*way.T, color=colour, linewidth=0.8, alpha=0.55 if well else 0.8, zorder=3 + (not well))
            one.plot(*way[0], "o", color=colour, markersize=2.6, markeredgewidth=0.0, zorder=5)
        tolerance = run.task.tolerance
        one.add_patch(
            Circle((0, 0), tolerance.position, facecolor=PAPER, edgecolor=INK, linewidth=1.0, zorder=6)
        )
        if tolerance.heading_deg:
            one.annotate(
                "",
                (0.9, 0.0),
                (0.0, 0.0),
                arrowprops={"arrowstyle": "-|>", "color": INK, "linewidth": 1.1, "shrinkA": 0, "shrinkB": 0},
                zorder=7,
            )
        told(one, f"{int(reached.sum())} of {len(reached)} stay at the goal")
        one.set_aspect("equal")
        one.set_xlim(-HALF, HALF)
        one.set_ylim(-HALF, HALF)
        one.set_xlabel("x from the goal [m]")
        quiet_grid(one)
    axes[0, 0].set_ylabel("y from the goal [m]")
    return figure


def _about_the_goal(run: View) -> np.ndarray:
    """Ways with the goal at the origin, shape (kept, steps + 1, 2) [m]."""
    outcome = run.main
    way = np.concatenate((outcome.starts[:, None, :2], outcome.paths[:, :, :2]), axis=1)
    offset = way - outcome.targets[:, :1, :2]
    if not run.task.tolerance.heading_deg:
        return offset
    yaw = outcome.targets[:, :1, 2]
    c, s = np.cos(yaw), np.sin(yaw)
    return np.stack((c * offset[..., 0] + s * offset[..., 1], c * offset[..., 1] - s * offset[..., 0]), -1)
