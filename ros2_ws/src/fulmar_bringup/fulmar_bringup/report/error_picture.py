"""How far from the goal, over time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from fulmar_bringup.report.style import DASHED, FAINT, INK, quiet_grid
from fulmar_bringup.report.view import View, judged

LENGTHS = {0.001: "1 mm", 0.01: "1 cm", 0.1: "10 cm", 1.0: "1 m", 10.0: "10 m"}
ANGLES = {0.01: "0.01°", 0.1: "0.1°", 1.0: "1°", 10.0: "10°", 100.0: "100°"}


def draw_errors(position: Axes, heading: Axes, runs: Sequence[View]) -> None:
    """Position and heading error of every run, on a logarithmic scale with the tolerances."""
    for run, judgement in judged(runs):
        position.plot(judgement.time_s, judgement.run.position_error[0], color=run.colour, label=run.label)
        degrees = np.abs(np.rad2deg(judgement.run.heading_error[0]))
        heading.plot(judgement.time_s, degrees, color=run.colour, linewidth=1.2)
    _finish(position, runs, LENGTHS, "distance to goal", 2e-3)
    _finish(heading, runs, ANGLES, "heading error", 2e-2)
    heading.set_xlabel("time [s]")
    for _, judgement in judged(runs)[:1]:
        tolerance = judgement.task.tolerance
        _limit(position, tolerance.position, f"tolerance {100 * tolerance.position:g} cm")
        if tolerance.heading_deg < 180.0:
            _limit(heading, tolerance.heading_deg, f"tolerance {tolerance.heading_deg:g}°")
        position.text(
            0.5 * (judgement.window_start_s + judgement.duration_s),
            1.02,
            f"last {tolerance.hold_s:g} s",
            transform=position.get_xaxis_transform(),
            ha="center",
            va="bottom",
            fontsize=8.5,
            color=FAINT,
        )


def _finish(axes: Axes, runs: Sequence[View], names: dict[float, str], label: str, lowest: float) -> None:
    quiet_grid(axes)
    axes.set_xlim(0.0, max((judgement.duration_s for _, judgement in judged(runs)), default=1.0))
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(FixedLocator(list(names)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: names.get(value, "")))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.set_ylim(bottom=lowest)
    axes.set_ylabel(label)
    for _, judgement in judged(runs):
        axes.axvspan(judgement.window_start_s, judgement.duration_s, color=FAINT, alpha=0.12, linewidth=0)


def _limit(axes: Axes, value: float, label: str) -> None:
    axes.axhline(value, color=INK, linestyle=DASHED, linewidth=1.0)
    axes.text(0.005, value, label, transform=axes.get_yaxis_transform(), va="bottom", fontsize=8.5, color=INK)
