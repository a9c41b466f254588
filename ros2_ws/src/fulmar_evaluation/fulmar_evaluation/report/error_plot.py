"""Errors of position, heading or attitude, and motion over time, or targets reached, as the task asks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from fulmar_core.tasks.terms import Tolerance
from fulmar_evaluation.report.drawing import ANGLES, LENGTHS, limit_line, log_scale
from fulmar_evaluation.report.run_view import View, evaluated
from fulmar_evaluation.report.style import FAINT, quiet_grid
from fulmar_evaluation.run_evaluation import RunResult

SPEEDS = {0.001: "1 mm/s", 0.01: "1 cm/s", 0.1: "10 cm/s", 1.0: "1 m/s", 10.0: "10 m/s"}
DEEPEST = (
    0.05  # of the usual end of a scale: below that nothing matters, such as an error that changes its sign
)
CUT = 0.01  # share of a curve's samples that may lie below the scale
TURN_RATES = {0.01: "0.01°/s", 0.1: "0.1°/s", 1.0: "1°/s", 10.0: "10°/s", 100.0: "100°/s"}


@dataclass(frozen=True)
class Strip:
    """One quantity over time, on a logarithmic scale."""

    label: str
    marks: dict[float, str]  # of the scale
    lowest: float  # of the scale, where the curves do not go below it
    values: Callable[[RunResult], np.ndarray]
    tolerance: Callable[[Tolerance], float]  # 0: there is none
    unit: str  # of the tolerance


STRIPS = (
    Strip("distance", LENGTHS, 2e-3, lambda r: r.run.position_error[0], lambda t: t.position, "m"),
    Strip(
        "heading error", ANGLES, 2e-2, lambda r: _deg(r.run.heading_error[0]), lambda t: t.heading_deg, "°"
    ),
    Strip(
        "attitude error",
        ANGLES,
        2e-2,
        lambda r: _in_space(r, r.run.attitude_error),
        lambda t: t.attitude_deg,
        "°",
    ),
    Strip("velocity error", SPEEDS, 2e-3, lambda r: r.run.velocity_error[0], lambda t: t.velocity, "m/s"),
    Strip(
        "turn rate error",
        TURN_RATES,
        2e-2,
        lambda r: _deg(r.run.yaw_rate_error[0]),
        lambda t: t.yaw_rate_deg,
        "°/s",
    ),
    Strip(
        "turn rate error",
        TURN_RATES,
        2e-2,
        lambda r: _in_space(r, r.run.rate_error),
        lambda t: t.rate_deg,
        "°/s",
    ),
)


def _deg(angle: np.ndarray) -> np.ndarray:
    return np.asarray(np.abs(np.rad2deg(angle)))


def _in_space(result: RunResult, errors: np.ndarray | None) -> np.ndarray:
    """Errors that robots in the plane have not; NaN for them."""
    return np.full(len(result.time_s), np.nan) if errors is None else _deg(errors[0])


def strips(runs: Sequence[View]) -> list[Strip]:
    """The quantities that the task of the runs asks for."""
    return [
        strip
        for strip in STRIPS
        if any(not np.isnan(strip.values(result)).all() for _, result in evaluated(runs))
    ] or list(STRIPS[:2])


def draw_progress(rows: Sequence[Axes] | np.ndarray, runs: Sequence[View]) -> None:
    """Targets reached where the task counts them, in the first row; then each of `strips`."""
    chosen = strips(runs)
    if counting(runs):
        _reached(rows[0], runs)
    for axes, strip in zip(rows[-len(chosen) :], chosen, strict=True):
        _errors(axes, runs, strip)
    for axes in rows[:-1]:
        axes.tick_params(labelbottom=False)
    rows[-1].set_xlabel("time [s]")
    for _, result in evaluated(runs)[:1]:
        hold_s = result.task.tolerance.hold_s
        if hold_s > 0.0 and not result.counts:
            rows[0].text(
                0.5 * (result.window_start_s + result.duration_s),
                1.02,
                f"last {hold_s:g} s",
                transform=rows[0].get_xaxis_transform(),
                ha="center",
                va="bottom",
                fontsize=8.5,
                color=FAINT,
            )


def counting(runs: Sequence[View]) -> bool:
    """Whether the task of the runs counts targets."""
    return any(result.counts for _, result in evaluated(runs))


def _reached(axes: Axes, runs: Sequence[View]) -> None:
    for run, result in evaluated(runs):
        axes.step(result.time_s, result.run.goals[0], where="post", color=run.colour, label=run.label)
        required = result.task.required
        if required is not None:
            limit_line(axes, required, f"{required} make a success")
    quiet_grid(axes)
    _span(axes, runs)
    axes.set_ylim(bottom=0.0)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_ylabel("targets reached")


def _bottom(runs: Sequence[View], strip: Strip) -> float:
    """Below what the curves show, so that a good run is not cut off at the end of the scale."""
    curves = [strip.values(result) for _, result in evaluated(runs)]
    lows = [float(np.quantile(seen, CUT)) for curve in curves if (seen := curve[curve > 0.0]).size]
    return max(DEEPEST * strip.lowest, min([strip.lowest, *(0.8 * low for low in lows)]))


def _top(axes: Axes, strip: Strip, bottom: float, limits: list[float]) -> float:
    """Above everything that is drawn, and above a mark that is near, so that the scale can be read off."""
    drawn = max([float(axes.dataLim.y1), *limits])
    if not bottom < drawn < np.inf:  # nothing is drawn, or nothing that would be seen
        return max(strip.marks)
    return 1.1 * min((mark for mark in strip.marks if drawn <= mark < 2.0 * drawn), default=drawn)


def _errors(axes: Axes, runs: Sequence[View], strip: Strip) -> None:
    log_scale(axes.yaxis, strip.marks)  # before the curves: one that is zero throughout has no place on it
    for run, result in evaluated(runs):
        axes.plot(result.time_s, strip.values(result), color=run.colour, linewidth=1.2, label=run.label)
    quiet_grid(axes)
    _span(axes, runs)
    limits = [strip.tolerance(result.task.tolerance) for _, result in evaluated(runs)[:1]]
    bottom = _bottom(runs, strip)
    axes.set_ylim(bottom, _top(axes, strip, bottom, limits))
    axes.set_ylabel(strip.label)
    for _, result in evaluated(runs):
        if not result.counts:
            axes.axvspan(result.window_start_s, result.duration_s, color=FAINT, alpha=0.12, linewidth=0)
    for limit in limits:
        if limit > 0.0:
            space = " " if strip.unit.startswith("m") else ""
            limit_line(axes, limit, f"tolerance {limit:g}{space}{strip.unit}")


def _span(axes: Axes, runs: Sequence[View]) -> None:
    axes.set_xlim(0.0, max((result.duration_s for _, result in evaluated(runs)), default=1.0))
