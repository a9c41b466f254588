"""Speed and turn rate over time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from fulmar_evaluation.report.run_view import View, evaluated
from fulmar_evaluation.report.style import quiet_grid

MOTION_ROWS = 2


def draw_motion(rows: Sequence[Axes] | np.ndarray, runs: Sequence[View]) -> None:
    """Speed in the first row, size of the turn rate in the second."""
    speed, turning = rows
    for run, result in evaluated(runs):
        look = {"color": run.colour, "linewidth": 1.2, "label": run.label}
        speed.plot(result.time_s, result.run.speed[0], **look)
        turning.plot(result.time_s, np.abs(np.rad2deg(result.run.yaw_rate[0])), **look)
    for axes, label in zip(rows, ("speed [m/s]", "turn rate [°/s]"), strict=True):
        quiet_grid(axes)
        axes.set_xlim(0.0, max((result.duration_s for _, result in evaluated(runs)), default=1.0))
        axes.set_ylim(bottom=0.0)
        axes.set_ylabel(label)
    speed.tick_params(labelbottom=False)
    turning.set_xlabel("time [s]")
