"""Plots of a report on satellites, each with its heading and caption, and their rows in the table of figures."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from fulmar_bags.other_readings import MOMENTS
from fulmar_evaluation.rate_sources import GYROSCOPE, gyroscope_ended_s, rate_sources
from fulmar_evaluation.report.page import Plot
from fulmar_evaluation.report.run_figures import WIDTH
from fulmar_evaluation.report.run_view import Row, View, evaluated
from fulmar_evaluation.report.satellite_plot import (
    ATTITUDE_ROWS,
    SIGMAS,
    draw_attitude,
    draw_inertia,
    draw_torques,
    draw_wheels,
    torque_rows,
    wheels_of,
)
from fulmar_evaluation.report.style import legend_above, legend_over


def attitude(runs: Sequence[View]) -> Plot:
    """Error and turn rate by axis."""
    figure = Figure(figsize=(WIDTH, 0.7 + 1.8 * ATTITUDE_ROWS), layout="constrained")
    rows = figure.subplots(ATTITUDE_ROWS, 1, sharex=True)
    draw_attitude(rows, runs)
    legend_above(figure, rows[0])
    caption = """
    About the axes of the body: the turn that is missing to the wanted attitude, on a scale that is linear within
    0.01° and logarithmic beyond it, and the true turn rate."""
    if any(gyroscope_ended_s(run.record) is not None for run in runs):
        caption += """ The red line is the last word of the gyroscope. The tint shows from what the estimator took the
        turn rate after that."""
    return Plot("Attitude error and turn rate by axis", caption, figure)


def wheels(runs: Sequence[View]) -> Plot:
    """Speeds and momentum of the wheels."""
    figure, axes = _one(2.5)
    draw_wheels(axes, runs)
    legend_above(figure, axes)
    caption = """
    As the tachometers report them, relative to the body. A wheel at its limit takes no more momentum: the satellite can
    no longer be turned the way that asks for it."""
    return Plot("Speed and momentum of the wheels", caption, figure)


def torques(runs: Sequence[View]) -> Plot:
    """Torques of motors and of what unloads the wheels."""
    count = torque_rows(runs)
    figure = Figure(figsize=(WIDTH, 0.5 + 1.7 * count * len(runs)), layout="constrained")
    rows = figure.subplots(count * len(runs), 1, squeeze=False)[:, 0]
    for number, run in enumerate(runs):
        draw_torques(rows[count * number : count * (number + 1)], run)
    caption = """
    What was really applied, after all limits. A motor's torque acts on its wheel, and the opposite one on the body."""
    if count > 1:
        caption += " The unloading turns from outside against the momentum that the wheels have collected."
    return Plot("Torques of the motors", caption, figure)


def inertia(runs: Sequence[View]) -> Plot | None:
    """What was estimated of the inertia; None where nothing was."""
    if not any(len(run.record.inertia) for run in runs):
        return None
    figure, axes = _one(2.6)
    draw_inertia(axes, runs)
    legend_above(figure, axes)
    return Plot(
        "Estimated inertia",
        "About the body's axes, with its wheels locked. The bands hold the true value in 95 of 100 cases, if the "
        "estimator is right about itself; dashed is the robot's file.",
        figure,
    )


def sheet_path(figure: SubFigure, runs: Sequence[View]) -> None:
    """Attitude, wheels and, where it was estimated, inertia, below one another."""
    estimated = any(len(run.record.inertia) for run in runs)
    rows = figure.subplots(ATTITUDE_ROWS + 1 + estimated, 1)
    draw_attitude(rows[:ATTITUDE_ROWS], runs)
    draw_wheels(rows[ATTITUDE_ROWS], runs)
    if estimated:
        draw_inertia(rows[-1], runs)
    for axes in rows:
        axes.label_outer()
    for axes in rows[1:]:
        legend_over(axes)


def sheet_torques(figure: SubFigure, runs: Sequence[View]) -> None:
    """Torques of each run, side by side."""
    count = torque_rows(runs)
    for column, run in zip(figure.subplots(count, len(runs), squeeze=False).T, runs, strict=True):
        draw_torques(column, run)


def table(runs: Sequence[View]) -> list[Row]:
    """Wheels, gyroscope and inertia in figures."""

    def row(what: str, why: str, cell: Callable[[View], str]) -> Row:
        return what, why, [cell(run) for run in runs]

    return [
        row("Fastest wheel", "share of its top speed", _fastest),
        row("Turn rate from", "as the estimator chose", _sources),
        row("Gyroscope silent", "from when on", _silent),
        row("Estimated inertia [kg·m²]", "xx, yy, zz, and what 95 of 100 errors are below", _estimate),
    ]


def _fastest(run: View) -> str:
    speeds = np.abs(run.record.wheels.values)
    for _, result in evaluated([run]):
        if speeds.size:
            top = wheels_of(result).top_speed
            return f"{100.0 * speeds.max() / top:.2g} %, {speeds.max():.3g} of {top:.4g} rad/s"
    return "–"


def _sources(run: View) -> str:
    found = rate_sources(run.record)
    return ", then ".join(
        each.name if number == 0 else f"{each.name} from {each.begin_s:.1f} s"
        for number, each in enumerate(found)
    ) or ("–" if not run.record.gyroscope_s else GYROSCOPE)


def _silent(run: View) -> str:
    died_s = gyroscope_ended_s(run.record)
    return "–" if died_s is None else f"{died_s:.1f} s"


def _estimate(run: View) -> str:
    found = run.record.inertia
    if not len(found):
        return "–"
    pairs = zip(found.tensor[-1, : len(MOMENTS) // 2], SIGMAS * found.std[-1, :3], strict=True)
    return ", ".join(
        f"{value:.3f} ± {spread:.3f}" if np.isfinite(spread) else f"{value:.3f}" for value, spread in pairs
    )


def _one(height: float) -> tuple[Figure, Axes]:
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    return figure, figure.subplots()
