"""The pictures of a report, each with a caption for somebody who has never seen one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from fulmar_bringup.report.error_picture import draw_errors
from fulmar_bringup.report.latency_picture import draw_latency
from fulmar_bringup.report.style import quiet_grid
from fulmar_bringup.report.trajectory_picture import draw_close_up, draw_trajectory
from fulmar_bringup.report.valve_picture import draw_gas, draw_valves
from fulmar_bringup.report.view import View

WIDTH = 6.2  # [inch]; set so that the type is readable on a phone and not shouting on a desk


@dataclass(frozen=True)
class Picture:
    """A drawn figure with its words."""

    title: str
    caption: str
    figure: Figure


def pictures(runs: Sequence[View]) -> list[Picture]:
    """Draw everything that the runs have to show; call inside `house_style`."""
    drawn = [_trajectory(runs), _errors(runs), _valves(runs), _gas(runs), _latency(runs)]
    return drawn if any(run.judgement for run in runs) else []


def overview(runs: Sequence[View], title: str) -> Figure:
    """All of it on one sheet; call inside `house_style`."""
    rows = len(runs)
    figure = Figure(figsize=(11.0, 5.6 + 1.5 * rows), layout="constrained")
    top, bottom = figure.subfigures(2, 1, height_ratios=(4.9, 1.5 * rows + 0.2))
    left, right = top.subfigures(1, 2, width_ratios=(1.0, 1.0))
    path = left.subplots()
    draw_trajectory(path, runs)
    path.legend(loc="best")
    axes = right.subplots(3, 1, gridspec_kw={"height_ratios": (1.0, 1.0, 0.9)})
    draw_errors(axes[0], axes[1], runs)
    draw_latency(axes[2], runs)
    for one, run in zip(bottom.subplots(rows, 1, sharex=True, squeeze=False)[:, 0], runs, strict=True):
        draw_valves(one, run)
        one.set_xlabel("time [s]")
        one.label_outer()
    figure.suptitle(title, fontsize=13, fontweight="bold")
    return figure


def _trajectory(runs: Sequence[View]) -> Picture:
    figure = Figure(figsize=(WIDTH, 3.7), layout="constrained")
    whole, close = figure.subplots(1, 2, gridspec_kw={"width_ratios": (1.75, 1.0)})
    draw_trajectory(whole, runs)
    draw_close_up(close, runs)
    whole.legend(loc="best")
    (left, right), (low, high) = whole.get_xlim(), whole.get_ylim()
    figure.set_size_inches(WIDTH, np.clip(0.55 + 3.3 * (high - low) / (right - left), 2.6, 5.0))
    caption = """
    Circles show the platform's outline along the way; the stroke inside points where it is heading. The
    arrow at the goal is the wanted heading. On the right, the last stretch: bold is the closing window,
    the dot is the end, the dashed circle is the tolerance."""
    return Picture("The path, seen from above", _words(caption), figure)


def _errors(runs: Sequence[View]) -> Picture:
    figure = Figure(figsize=(WIDTH, 3.9), layout="constrained")
    position, heading = figure.subplots(2, 1, sharex=True)
    draw_errors(position, heading, runs)
    position.legend(loc="upper right", ncols=len(runs))
    caption = """
    Both scales are logarithmic: each grid line is ten times the one below. To succeed, a line must stay
    below its dashed tolerance throughout the shaded window."""
    return Picture("How far from the goal", _words(caption), figure)


def _valves(runs: Sequence[View]) -> Picture:
    figure = Figure(figsize=(WIDTH, 0.5 + 1.75 * len(runs)), layout="constrained")
    axes = figure.subplots(len(runs), 1, sharex=True, squeeze=False)[:, 0]
    for one, run in zip(axes, runs, strict=True):
        draw_valves(one, run)
    axes[-1].set_xlabel("time [s]")
    caption = """
    One row for each of the valves; a bar means gas is flowing. This is what was really applied, after
    all limits. Where the watchdog had to close the valves because commands stopped coming, the picture
    is tinted."""
    return Picture("Which valves were open", _words(caption), figure)


def _gas(runs: Sequence[View]) -> Picture:
    figure = Figure(figsize=(WIDTH, 2.3), layout="constrained")
    axes = figure.subplots()
    draw_gas(axes, list(runs))
    quiet_grid(axes)
    axes.legend(loc="lower right", ncols=len(runs))
    caption = """
    Open time of all valves added up: two valves open for one second count as two seconds. Less is
    better; a flat line means that the platform rests."""
    return Picture("Gas used", _words(caption), figure)


def _latency(runs: Sequence[View]) -> Picture:
    figure = Figure(figsize=(WIDTH, 2.7), layout="constrained")
    axes = figure.subplots()
    draw_latency(axes, runs)
    caption = """
    Time from a measurement to the command that answers it, as the recorder saw both pass; the scale is
    logarithmic. The solid line is the median (p50); 99 of 100 commands come before the dashed one (p99)."""
    return Picture("How fast the controller answers", _words(caption), figure)


def _words(text: str) -> str:
    return " ".join(text.split())
