"""Plots of a report of runs, each with its heading and caption."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from fulmar_evaluation.report.control_plot import actuators_height, draw_actuators, draw_latency, draw_use
from fulmar_evaluation.report.error_plot import counting, draw_progress, strips
from fulmar_evaluation.report.flight_plot import (
    FLIGHT_MOTION_ROWS,
    PATH_ROWS,
    draw_flight,
    draw_flight_motion,
    draw_flight_path,
    draw_surfaces,
    flight_rows,
)
from fulmar_evaluation.report.motion_plot import MOTION_ROWS, draw_motion
from fulmar_evaluation.report.page import Plot
from fulmar_evaluation.report.run_view import View, evaluated
from fulmar_evaluation.report.space_plot import draw_space, space_height
from fulmar_evaluation.report.style import legend, quiet_grid
from fulmar_evaluation.report.supply_plot import TITLE, draw_supply
from fulmar_evaluation.report.trajectory_plot import draw_close_up, draw_trajectory, has_place

WIDTH = 6.2  # [inch]; set so that the type is readable on a phone and not shouting on a desk


def strip_count(runs: Sequence[View]) -> int:
    """Strips over time that `draw_progress` fills."""
    return len(strips(runs)) + counting(runs)


def trajectory(runs: Sequence[View]) -> Plot:
    """The way in the plane, and a close look at the goal."""
    figure = Figure(figsize=(WIDTH, 3.7), layout="constrained")
    near = any(has_place(result) for _, result in evaluated(runs))
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
    for name in dict.fromkeys(name for _, result in evaluated(runs) for name in result.things):
        caption += f" The dashed line is the way of the {name}, the square its end."
    if any(len(result.path) for _, result in evaluated(runs)):
        caption += " The dashed line is the path that was to be followed."
    if counting(runs):
        caption += (
            " Numbered circles are the targets, as large as the tolerance; those that were reached are grey."
        )
    if near:
        caption += """ An arrow at the goal is the wanted heading. On the right, the last stretch: bold is the closing
        window, the dot is the end, the dashed circle is the tolerance."""
    return Plot("The path, seen from above", caption, figure)


def space_path(runs: Sequence[View]) -> Plot:
    """The way in space from two sides."""
    figure = Figure(figsize=(WIDTH, space_height(runs)), layout="constrained")
    near = draw_space(figure, runs)
    caption = """
    Both views have one scale. Circles show the robot's outline along the way, the strokes inside the axes of its body:
    one that points at you looks short."""
    if counting(runs):
        caption += (
            " Numbered circles are the targets, as large as the tolerance; those that were reached are grey."
        )
    if any(result.task.structures for _, result in evaluated(runs)):
        caption += " The thing in space is drawn faintly; the dashed circle about it is its keep-out volume."
    if any(result.target_moves for _, result in evaluated(runs)):
        caption += """ The goal moves: the dashed line is its path, the white dot its end. Below, the way as seen from
        the goal: bold is the closing window, the dashed circle is the tolerance."""
    elif near:
        caption += """ The white dot is the goal, as large as the tolerance; where an attitude is asked for, thin
        strokes are the wanted axes. Below, the last stretch: bold is the closing window, the dot is the end, the dashed
        circle is the tolerance."""
    return Plot("The path, seen from above and from the side", caption, figure)


def flight_path(runs: Sequence[View]) -> Plot:
    """The way of a flight, beside its reference."""
    figure = Figure(figsize=(WIDTH, 1.0 + 1.6 * PATH_ROWS), layout="constrained")
    rows = figure.subplots(PATH_ROWS, 1)
    draw_flight_path(rows, runs)
    legend(rows[0], loc="best", ncols=1 + len(runs))
    caption = """
    Each view has a scale of its own: a flight is much longer than it is wide or high."""
    return Plot("The path, seen from above and from the side", caption, figure)


def flight(runs: Sequence[View]) -> Plot:
    """Height and energy of a flight."""
    count = flight_rows(runs)
    figure = Figure(figsize=(WIDTH, 0.5 + 1.5 * count), layout="constrained")
    rows = figure.subplots(count, 1, sharex=True)
    draw_flight(rows, runs)
    legend(rows[0], loc="upper right", ncols=len(runs))
    caption = """
    The dashed line is the reference, where there is one. Energy is the mean square of the throttles, added up: so many
    seconds at full throttle would cost as much."""
    return Plot("Height and energy", caption, figure)


def flight_motion(runs: Sequence[View]) -> Plot:
    """Airspeed, attitude and turn rates of a flight."""
    figure = Figure(figsize=(WIDTH, 0.5 + 1.6 * FLIGHT_MOTION_ROWS), layout="constrained")
    draw_flight_motion(figure.subplots(FLIGHT_MOTION_ROWS, 1, sharex=True), runs)
    caption = """
    Speed through the air as the probe measures it, speed over the ground, and roll, pitch and turn rates as they truly
    are. Dashed are the roll and pitch that are wanted. Turn rates are about the body's axes: x ahead, y to the left, z
    up."""
    return Plot("How it flew", caption, figure)


def surfaces(runs: Sequence[View]) -> Plot:
    """What the surfaces and throttles of aircraft did."""
    figure = Figure(figsize=(WIDTH, 4.0 * len(runs)), layout="constrained")
    rows = figure.subplots(2 * len(runs), 1, squeeze=False)[:, 0]
    for number, run in enumerate(runs):
        draw_surfaces(rows[2 * number : 2 * number + 2], run)
    caption = """
    A positive elevator lowers the nose, a positive aileron the right wing, and a positive rudder turns to the left."""
    return Plot("What surfaces and throttles did", caption, figure)


def motion(runs: Sequence[View]) -> Plot:
    """Speed and turn rate."""
    figure = Figure(figsize=(WIDTH, 0.5 + 1.4 * MOTION_ROWS), layout="constrained")
    rows = figure.subplots(MOTION_ROWS, 1, sharex=True)
    draw_motion(rows, runs)
    legend(rows[0], loc="upper right", ncols=len(runs))
    return Plot("How fast it moved and turned", "The turn rate counts about whatever axis it is.", figure)


def progress(runs: Sequence[View]) -> Plot:
    """Errors over time, or how many targets were reached."""
    count, counts = strip_count(runs), counting(runs)
    figure = Figure(figsize=(WIDTH, 0.5 + 1.7 * count), layout="constrained")
    rows = figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0]
    draw_progress(rows, runs)
    legend(rows[0], loc="upper left" if counts else "upper right", ncols=len(runs))
    caption = "The scales of errors are logarithmic: each grid line is ten times the one below."
    if counts:
        return Plot("How many targets, and how far from the next", caption, figure)
    caption += """ To succeed, a line must stay below its dashed tolerance throughout the shaded window."""
    return Plot("How far from the goal", caption, figure)


def actuators(runs: Sequence[View]) -> Plot:
    """What actuators did."""
    figure = Figure(figsize=(WIDTH, 0.5 + len(runs) * actuators_height(runs, 1.75)), layout="constrained")
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
    actuators safe because commands stopped coming, the plot is tinted."""
    return Plot(title, caption, figure)


def use(runs: Sequence[View]) -> Plot:
    """How much the actuators were used."""
    figure = Figure(figsize=(WIDTH, 2.3), layout="constrained")
    axes = figure.subplots()
    draw_use(axes, runs)
    quiet_grid(axes)
    legend(axes, loc="lower right", ncols=len(runs))
    if all(run.binary for run in runs):
        caption = """
        Open time of all valves added up: two valves open for one second count as two seconds. Less is
        better; a flat line means that the robot rests."""
        return Plot("Gas used", caption, figure)
    caption = """
    Shares of full command of all actuators, added up over time: two at half command for one second count as one
    second. A flat line means that the robot rests or rolls on."""
    return Plot("Effort spent", caption, figure)


def supply(runs: Sequence[View]) -> Plot:
    """Pressure of what feeds the thrusters."""
    figure = Figure(figsize=(WIDTH, 2.1), layout="constrained")
    axes = figure.subplots()
    draw_supply(axes, runs)
    legend(axes, loc="lower left", ncols=len(runs))
    caption = """
    As the gauge of the tank reports it. Below the dashed line, the pressure of the regulator, thrust falls with it."""
    return Plot(TITLE, caption, figure)


def latency(runs: Sequence[View]) -> Plot:
    """How fast the controller answered."""
    figure = Figure(figsize=(WIDTH, 2.7), layout="constrained")
    axes = figure.subplots()
    draw_latency(axes, runs)
    caption = """
    Time from sending a measurement to sending the command that answers it; the scale is logarithmic.
    The solid line is the median (p50); 99 of 100 commands come before the dashed one (p99)."""
    return Plot("How fast the controller answers", caption, figure)
