"""How figures are spread over the episodes, in the batch and in MuJoCo."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from fulmar_benchmarks.roboran.cells import WAYS
from fulmar_benchmarks.roboran.report.view import WIDTH, View
from fulmar_evaluation.report.style import DASHED, FAINT, INK, quiet_grid

_LINES = {"batch": "-", "mujoco": DASHED, "ros": (0, (1, 1.5))}


@dataclass(frozen=True)
class _Spread:
    figure: str
    label: str
    ticks: tuple[float, ...] = ()  # of a logarithmic scale; none: a linear one


_PLACE = (
    _Spread("final_position_error_m", "final distance [m]", (0.001, 0.01, 0.1, 1.0, 10.0)),
    _Spread("time_to_target_s", "time to target [s]"),
    _Spread("control_deviation", "control deviation"),
)
SPREADS = {
    "go_to_position": _PLACE,
    "go_to_pose": (
        _PLACE[0],
        _Spread("final_heading_error_deg", "final heading error [°]", (0.01, 0.1, 1.0, 10.0, 100.0)),
        _PLACE[1],
    ),
    "go_to_position_with_obstacles": _PLACE,
    "track_velocities": (
        _Spread("velocity_error_m_s", "mean velocity error [m/s]"),
        _Spread("yaw_rate_error_deg_s", "mean turn-rate error [°/s]"),
        _Spread("settling_time_s", "settling time [s]"),
    ),
    "go_through_positions": (
        _Spread("share_of_bound", "share of the bound"),
        _Spread("goals_reached", "waypoints in 60 s"),
        _Spread("goals_in_1000_steps", "waypoints in 1,000 steps"),
    ),
}


def draw_spreads(runs: Sequence[View], task: str) -> Figure:
    """For each figure the share of episodes at or below it."""
    spreads = [
        one for one in SPREADS.get(task, _PLACE) if any(one.figure in run.main.figures for run in runs)
    ]
    figure = Figure(figsize=(WIDTH, 3.3), layout="constrained")
    axes = figure.subplots(1, len(spreads), sharey=True, squeeze=False)[0]
    for one, spread in zip(axes, spreads, strict=True):
        for run in runs:
            for way, outcome in run.outcomes.items():
                values = outcome.figures.get(spread.figure)
                if values is not None:
                    _steps(one, values, spread, color=run.colour, linestyle=_LINES[way])
        limit = _limit(runs[0], spread.figure)
        if limit is not None:
            one.axvline(limit, color=INK, linewidth=1.0, alpha=0.7)
        if spread.ticks:
            one.set_xscale("log")
            one.set_xlim(spread.ticks[0], None)
            one.xaxis.set_major_locator(FixedLocator(spread.ticks))
            one.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            one.xaxis.set_minor_locator(NullLocator())
        one.set_ylim(-2.0, 102.0)
        one.set_xlabel(spread.label)
        quiet_grid(one)
    axes[0].set_ylabel("episodes at or below [%]")
    figure.legend(handles=_key(runs), loc="outside upper left", ncols=len(runs) + 3, fontsize=9)
    return figure


def _steps(axes: Axes, values: np.ndarray, spread: _Spread, **look: object) -> None:
    """Cumulative share; episodes without the figure never come."""
    known = np.sort(values[np.isfinite(values)])
    if known.size == 0:
        return
    if spread.ticks:
        known = np.maximum(known, spread.ticks[0])
    share = 100.0 * np.arange(1, known.size + 1) / len(values)
    # A few hundred points draw the same line as thousands.
    pick = np.unique(np.linspace(0, known.size - 1, min(known.size, 300)).astype(int))
    x, y = np.concatenate((known[:1], known[pick])), np.concatenate(([0.0], share[pick]))
    axes.step(x, y, where="post", linewidth=1.4, **look)


def _limit(run: View, figure: str) -> float | None:
    tolerance = run.task.tolerance
    limits = {
        "final_position_error_m": tolerance.position,
        "final_heading_error_deg": tolerance.heading_deg,
        "velocity_error_m_s": tolerance.velocity,
        "yaw_rate_error_deg_s": tolerance.yaw_rate_deg,
    }
    return limits.get(figure)


def _key(runs: Sequence[View]) -> list[Line2D]:
    ways = [way for way in WAYS if any(way in run.outcomes for run in runs)]
    robots = [Line2D([], [], color=run.colour, label=run.label) for run in runs]
    return robots + [Line2D([], [], color=FAINT, linestyle=_LINES[way], label=WAYS[way]) for way in ways]
