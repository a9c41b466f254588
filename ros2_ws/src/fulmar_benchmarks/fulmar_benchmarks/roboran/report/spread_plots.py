"""Distribution of results over episodes: a map over their starts, and cumulative shares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fulmar_benchmarks.roboran.cells import WAYS
from fulmar_benchmarks.roboran.report.view import View, note, panels
from fulmar_benchmarks.unit import map_axes
from fulmar_evaluation.report.drawing import WIDTH, colour_lines, key, log_scale
from fulmar_evaluation.report.style import ALARM, DASHED, FAINT, INK, quiet_grid

BINS = 8  # along each axis of the map
FEWEST = 4  # episodes in a field that is drawn
_LEAST_SCALE = 5.0  # [%]
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
            log_scale(one.xaxis, spread.ticks)
            one.set_xlim(spread.ticks[0], None)
        one.set_ylim(-2.0, 102.0)
        one.set_xlabel(spread.label)
        quiet_grid(one)
    axes[0].set_ylabel("episodes at or below [%]")
    key(figure, _key(runs))
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
    robots = colour_lines({run.label: run.colour for run in runs})
    return robots + [Line2D([], [], color=FAINT, linestyle=_LINES[way], label=WAYS[way]) for way in ways]


def draw_map(runs: Sequence[View]) -> Figure:
    """Share of failed episodes, or the mean share of the bound, in fields of a map."""
    shares = "share_of_bound" in runs[0].main.figures
    figure, axes = panels(runs, 3.4, lines=1, sharey=True)
    drawn = [_fields(run, shares) for run in runs]
    known = np.concatenate([field[np.isfinite(field)] for _, _, field in drawn])
    top = 100.0 if shares else max(_LEAST_SCALE, float(known.max(initial=0.0)))
    colours = _colours(shares)
    for one, run, (x, y, field) in zip(axes[0], runs, drawn, strict=True):
        mesh = one.pcolormesh(x, y, field.T, cmap=colours, vmin=0.0, vmax=top, rasterized=False)
        mesh.set_edgecolor("face")
        one.set_facecolor("none")
        one.set_xlabel(map_axes(run.entry["task"])[0])
        one.tick_params(length=3.0)
        note(one, _summary(run, shares))
    vertical = map_axes(runs[0].entry["task"])[1]
    axes[0, 0].set_ylabel(vertical)
    if "bearing" in vertical:
        axes[0, 0].set_yticks((-180, -90, 0, 90, 180))
    bar = figure.colorbar(mesh, ax=list(axes[0]), pad=0.02, aspect=18)
    bar.set_label("mean share of the bound [%]" if shares else "failed episodes [%]")
    bar.outline.set_edgecolor(FAINT)
    return figure


def _colours(shares: bool) -> LinearSegmentedColormap:
    """From nothing to alarm; for shares of a bound the other way round."""
    stops = ["#e9eef5", "#f4b6c8", ALARM, "#7a1237"]
    return LinearSegmentedColormap.from_list("fields", list(reversed(stops)) if shares else stops)


def _fields(run: View, shares: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Edges of the fields, and percent in each, NaN where too few episodes are."""
    outcome = run.main
    x, y = outcome.map_xy.T
    values = outcome.figures["share_of_bound"] if shares else 1.0 - outcome.succeeded
    low, high = np.min(outcome.map_xy, axis=0), np.max(outcome.map_xy, axis=0)
    edges = [np.linspace(a, max(b, a + 1e-6), BINS + 1) for a, b in zip(low, high, strict=True)]
    count, _, _ = np.histogram2d(x, y, bins=edges)
    total, _, _ = np.histogram2d(x, y, bins=edges, weights=np.nan_to_num(values))
    return edges[0], edges[1], np.where(count >= FEWEST, 100.0 * total / np.maximum(count, 1.0), np.nan)


def _summary(run: View, shares: bool) -> str:
    outcome = run.main
    if shares:
        return f"mean {100.0 * float(np.nanmean(outcome.figures['share_of_bound'])):.0f} %"
    failed = int(np.count_nonzero(~outcome.succeeded))
    return f"{failed:,} of {len(outcome.succeeded):,} failed"
