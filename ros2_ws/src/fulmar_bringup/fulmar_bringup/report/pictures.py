"""The pictures of a report, each with a caption for somebody who has never seen one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from fulmar_bringup.report.actuator_picture import draw_actuators, draw_use
from fulmar_bringup.report.error_picture import counting, draw_progress, strips
from fulmar_bringup.report.latency_picture import draw_latency
from fulmar_bringup.report.style import legend, quiet_grid
from fulmar_bringup.report.trajectory_picture import draw_close_up, draw_trajectory, has_place
from fulmar_bringup.report.view import View, judged

WIDTH = 6.2  # [inch]; set so that the type is readable on a phone and not shouting on a desk


@dataclass(frozen=True)
class Picture:
    """A drawn figure with its words."""

    title: str
    caption: str
    figure: Figure


def pictures(runs: Sequence[View]) -> list[Picture]:
    """Draw everything that the runs have to show; call inside `house_style`."""
    drawn = [_trajectory(runs), _progress(runs), _actuators(runs), _use(runs), _latency(runs)]
    return drawn if any(run.judgement for run in runs) else []


def overview(runs: Sequence[View], title: str) -> Figure:
    """All of it on one sheet; call inside `house_style`."""
    rows = len(runs)
    figure = Figure(figsize=(11.0, 5.6 + 1.5 * rows), layout="constrained")
    top, bottom = figure.subfigures(2, 1, height_ratios=(4.9, 1.5 * rows + 0.2))
    left, right = top.subfigures(1, 2, width_ratios=(1.0, 1.0))
    path = left.subplots()
    draw_trajectory(path, runs)
    legend(path, loc="best")
    count = _rows(runs)
    axes = right.subplots(count + 1, 1, gridspec_kw={"height_ratios": (*[1.0] * count, 0.9)})
    draw_progress(axes[:-1], runs)
    draw_latency(axes[-1], runs)
    for one, run in zip(bottom.subplots(rows, 1, sharex=True, squeeze=False)[:, 0], runs, strict=True):
        draw_actuators(one, run)
        one.set_xlabel("time [s]")
        one.label_outer()
    figure.suptitle(title, fontsize=13, fontweight="bold")
    return figure


def _rows(runs: Sequence[View]) -> int:
    """Strips over time that `draw_progress` fills."""
    return len(strips(runs)) + counting(runs)


def _trajectory(runs: Sequence[View]) -> Picture:
    figure = Figure(figsize=(WIDTH, 3.7), layout="constrained")
    near = any(has_place(judgement) for _, judgement in judged(runs))
    if near:
        whole, close = figure.subplots(1, 2, gridspec_kw={"width_ratios": (1.75, 1.0)})
        draw_close_up(close, runs)
    else:
        whole = figure.subplots()
    draw_trajectory(whole, runs)
    legend(whole, loc="best")
    (left, right), (low, high) = whole.get_xlim(), whole.get_ylim()
    width = 3.3 if near else 5.0
    figure.set_size_inches(WIDTH, np.clip(0.55 + width * (high - low) / (right - left), 2.6, 6.0))
    caption = """
    Circles show the robot's outline along the way; the stroke inside points where it is heading."""
    if any(len(run.record.obstacles) for run in runs):
        caption += " Grey discs are obstacles."
    for name in dict.fromkeys(name for _, judgement in judged(runs) for name in judgement.things):
        caption += f" The dashed line is the way of the {name}, the square its end."
    if any(len(judgement.path) for _, judgement in judged(runs)):
        caption += " The dashed line is the path that was to be followed."
    if counting(runs):
        caption += (
            " Numbered circles are the targets, as large as the tolerance; those that were reached are grey."
        )
    if near:
        caption += """ An arrow at the goal is the wanted heading. On the right, the last stretch: bold is the closing
        window, the dot is the end, the dashed circle is the tolerance."""
    return Picture("The path, seen from above", _words(caption), figure)


def _progress(runs: Sequence[View]) -> Picture:
    count, counts = _rows(runs), counting(runs)
    figure = Figure(figsize=(WIDTH, 0.5 + 1.7 * count), layout="constrained")
    rows = figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0]
    draw_progress(rows, runs)
    legend(rows[0], loc="upper left" if counts else "upper right", ncols=len(runs))
    caption = "The scales of errors are logarithmic: each grid line is ten times the one below."
    if counts:
        return Picture("How many targets, and how far from the next", caption, figure)
    caption += """ To succeed, a line must stay below its dashed tolerance throughout the shaded window."""
    return Picture("How far from the goal", _words(caption), figure)


def _actuators(runs: Sequence[View]) -> Picture:
    figure = Figure(figsize=(WIDTH, 0.5 + 1.75 * len(runs)), layout="constrained")
    axes = figure.subplots(len(runs), 1, sharex=True, squeeze=False)[:, 0]
    for one, run in zip(axes, runs, strict=True):
        draw_actuators(one, run)
    axes[-1].set_xlabel("time [s]")
    if all(run.binary for run in runs):
        title, row = "Which valves were open", "valves; a bar means gas is flowing."
    else:
        title, row = "What the actuators did", "actuators; the full height of a row is the largest command."
    caption = f"""
    One row for each of the {row} This is what was really applied, after all limits. Where the watchdog had to make the
    actuators safe because commands stopped coming, the picture is tinted."""
    return Picture(title, _words(caption), figure)


def _use(runs: Sequence[View]) -> Picture:
    figure = Figure(figsize=(WIDTH, 2.3), layout="constrained")
    axes = figure.subplots()
    draw_use(axes, runs)
    quiet_grid(axes)
    legend(axes, loc="lower right", ncols=len(runs))
    if all(run.binary for run in runs):
        caption = """
        Open time of all valves added up: two valves open for one second count as two seconds. Less is
        better; a flat line means that the robot rests."""
        return Picture("Gas used", _words(caption), figure)
    caption = """
    Shares of full command of all actuators, added up over time: two at half command for one second count as one
    second. A flat line means that the robot rests or rolls on."""
    return Picture("Effort spent", _words(caption), figure)


def _latency(runs: Sequence[View]) -> Picture:
    figure = Figure(figsize=(WIDTH, 2.7), layout="constrained")
    axes = figure.subplots()
    draw_latency(axes, runs)
    caption = """
    Time from sending a measurement to sending the command that answers it; the scale is logarithmic.
    The solid line is the median (p50); 99 of 100 commands come before the dashed one (p99)."""
    return Picture("How fast the controller answers", _words(caption), figure)


def _words(text: str) -> str:
    return " ".join(text.split())
