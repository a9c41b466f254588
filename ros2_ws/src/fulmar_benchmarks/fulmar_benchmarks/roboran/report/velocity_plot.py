"""Wanted and true velocities of one episode."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from fulmar_benchmarks.roboran.report.view import View, panels
from fulmar_core.planar import to_body, wrapped
from fulmar_evaluation.report.style import DASHED, INK, quiet_grid

EPISODE = 0


def draw_velocities(runs: Sequence[View]) -> Figure:
    """Speed ahead, to the left, and turn rate of the first episode of every pair."""
    figure, axes = panels(runs, 5.2, rows=3, sharex=True, sharey="row")
    for column, run in enumerate(runs):
        time_s, wanted, true = _velocities(run)
        tolerance = run.task.tolerance
        widths = (tolerance.velocity, tolerance.velocity, tolerance.yaw_rate_deg)
        for row, (one, width) in enumerate(zip(axes[:, column], widths, strict=True)):
            one.fill_between(
                time_s,
                wanted[row] - width,
                wanted[row] + width,
                step="pre",
                color=run.colour,
                alpha=0.15,
                lw=0.0,
            )
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
