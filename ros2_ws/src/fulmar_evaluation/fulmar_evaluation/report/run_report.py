"""Report of one or several recorded runs: its sections, tables and plots."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import datetime
from html import escape
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure, SubFigure

from fulmar_bags.run_record import RunRecord
from fulmar_core.config.errors import ConfigError
from fulmar_core.states.spatial import SpatialState
from fulmar_evaluation.report.control_plot import actuators_height, draw_actuators, draw_latency, draw_use
from fulmar_evaluation.report.error_plot import counting, draw_progress, strips
from fulmar_evaluation.report.flight_plot import (
    FLIGHT_ROWS,
    PATH_ROWS,
    draw_flight,
    draw_flight_path,
    draw_surfaces,
    flies,
)
from fulmar_evaluation.report.motion_plot import MOTION_ROWS, draw_motion
from fulmar_evaluation.report.page import Part, Plot, cells, faint, html_page, table
from fulmar_evaluation.report.run_view import View, evaluated, in_space, result_of, rule, table_rows, views
from fulmar_evaluation.report.space_plot import draw_space, space_height
from fulmar_evaluation.report.style import legend, quiet_grid
from fulmar_evaluation.report.supply_plot import TITLE, draw_supply
from fulmar_evaluation.report.trajectory_plot import draw_close_up, draw_trajectory, has_place
from fulmar_evaluation.report.writer import write_document

WIDTH = 6.2  # [inch]; set so that the type is readable on a phone and not shouting on a desk


def write_report(
    records: Sequence[RunRecord], out: Path, title: str | None = None, *, force: bool = True
) -> Path:
    """Write a report.

    Args:
        records: At least one run; several are compared.
        out: A `.html` page that works offline, or a `.png` image. Its folder is made.
        title: Heading; made from the runs by default.
        force: Replace whatever file is there; False: only a report of the same runs.

    Raises:
        ConfigError: There is no run, the runs are of several tasks, or as `write_document` says.
        BagError: A run names no task or no goal.
    """
    if not records:
        raise ConfigError("there is no run to report on. Give at least one bag.")
    _check_alike(records)
    runs = views(records)
    task = str(runs[0].summary["task"] or "run").replace(SpatialState.SUFFIX, " in space")
    task = task.replace("_", " ").capitalize()
    title = title or f"{task}: {' and '.join(run.label for run in runs)}"
    return write_document(
        Path(out),
        [record.path for record in records],
        page=lambda mark: html_page(title, _parts(runs), mark=mark),
        sheet=lambda: _overview(runs, title),
        force=force,
    )


def _check_alike(records: Sequence[RunRecord]) -> None:
    """Refuse runs of several tasks, whose figures mean different things."""
    first = records[0]
    for record in records:
        if record.info.get("task") != first.info.get("task"):
            raise ConfigError(
                f"{record.path} is of task '{record.info.get('task')}', {first.path} of '{first.info.get('task')}'. "
                "A report compares runs of one task; make one for each."
            )


def _parts(runs: Sequence[View]) -> list[Part]:
    path: tuple[Callable[[Sequence[View]], Plot], ...]
    path = (_space_path, _progress, _motion) if in_space(runs) else (_trajectory, _progress)
    if all(result.robot.actuators.turns_only for _, result in evaluated(runs)):
        path = (_progress, _motion)  # a satellite stays where it is
    if flies(runs):
        path = (_flight_path, _progress, _flight, _motion)
    use = (_surfaces,) if flies(runs) else (_actuators, _use)
    gauge = (_supply,) if any(len(run.record.supply) for run in runs) else ()
    plots = (*path, *use, *gauge, _latency) if evaluated(runs) else ()
    return [
        *faint(_subtitle(runs)),
        f'<div class="results">{"".join(map(_result, runs))}</div>',
        *faint(rule(runs)),
        *(_unread(run) for run in runs if run.record.warnings),
        *(_warnings(run) for run in runs if run.summary["warnings"]),
        *(_beliefs(run) for run in runs if run.summary["beliefs"]),
        "<h2>In figures</h2>",
        _table(runs),
        *(plot(runs) for plot in plots),
        "<h2>Where this comes from</h2>",
        f"<dl>{''.join(map(_origin, runs))}</dl>",
    ]


def _subtitle(runs: Sequence[View]) -> str:
    first = runs[0]
    parts = [str(first.summary["robot"] or "unknown robot").replace("_", " ")]
    if first.result is not None:
        parts.append(first.result.task.title)
    parts.append(f"{first.summary['backend']} backend")
    if len(first.record.motion):
        parts.append(datetime.fromtimestamp(float(first.record.motion.log_s[0])).strftime("%-d %B %Y, %H:%M"))
    return " · ".join(parts)


def _run_colour(run: View) -> str:
    return f'style="--run: {run.colour}"'


def _name(run: View) -> str:
    return f'<span class="dot"></span>{escape(run.label)}'


def _result(run: View) -> str:
    word, sentence = result_of(run)
    text = f"{_name(run)}<br><b>{word}</b><p>{escape(sentence)}</p>"
    return f'<div class="result" {_run_colour(run)}>{text}</div>'


def _warnings(run: View) -> str:
    lines = "".join(f"<li>{escape(warning)}</li>" for warning in run.summary["warnings"])
    return f"<p>{_name(run)}: warnings</p><ul>{lines}</ul>"


def _unread(run: View) -> str:
    lines = "; ".join(run.record.warnings[:5])
    return faint(f"{run.label}: part of the bag could not be read. {lines}")[0]


def _beliefs(run: View) -> str:
    return f"<p>{_name(run)}: at the end of the run, {escape(run.summary['beliefs'])}.</p>"


def _table(runs: Sequence[View]) -> str:
    heads = ["<th></th>", *(f"<th {_run_colour(run)}>{_name(run)}</th>" for run in runs)]
    rows = (
        f"<tr><td>{escape(what)}{f'<small>{escape(why)}</small>' if why else ''}</td>{cells(values)}</tr>"
        for what, why, values in table_rows(runs)
    )
    return table(heads, rows)


def _origin(run: View) -> str:
    info = run.record.info
    lines = [f"<code>{escape(str(info['command']))}</code>"] if info.get("command") else []
    if info.get("name") not in (None, "", info.get("robot")):
        lines.append(escape(f"{info['name']}, a {info.get('robot')}"))
    lines.append(
        f"bag <code>{escape(str(run.record.path))}</code>, seed {escape(str(info.get('seed', '–')))}"
    )
    versions = [f"Fulmar {info['fulmar_version']}"] if info.get("fulmar_version") else []
    versions += [f"revision {info['git_revision']}"] if info.get("git_revision") else []
    sha256 = run.record.controller.get("sha256")
    versions += [f"controller SHA-256 {str(sha256)[:16]}"] if sha256 else []
    lines.append(escape(", ".join(versions)))
    return f"<dt {_run_colour(run)}>{_name(run)}</dt>" + "".join(
        f'<dd class="faint">{line}</dd>' for line in lines if line
    )


def _overview(runs: Sequence[View], title: str) -> Figure:
    """All of it on one sheet."""
    rows, space = len(runs), in_space(runs)
    count, motion = _rows(runs), MOTION_ROWS if space else 0
    high = 1.28 * max(count + motion + 1, PATH_ROWS + FLIGHT_ROWS if flies(runs) else 0) if space else 4.9
    low = 3.6 if flies(runs) else rows * actuators_height(runs, 1.5) + 0.2
    figure = Figure(figsize=(11.0, high + low + 0.5), layout="constrained")
    top, bottom = figure.subfigures(2, 1, height_ratios=(high, low))
    near = space and any(has_place(result) for _, result in evaluated(runs))
    left, right = top.subfigures(1, 2, width_ratios=(1.2 if near else 1.0, 1.0))
    if flies(runs):
        _flight_overview(left, runs)
    elif space:
        draw_space(left, runs, stacked=True)
    else:
        path = left.subplots()
        draw_trajectory(path, runs)
        legend(path, loc="best")
    axes = right.subplots(
        count + motion + 1, 1, gridspec_kw={"height_ratios": (*[1.0] * (count + motion), 0.9)}
    )
    draw_progress(axes[:count], runs)
    if space:
        axes[count - 1].set_xlabel("")
        draw_motion(axes[count:-1], runs)
    draw_latency(axes[-1], runs)
    if flies(runs):
        for pair, run in zip(bottom.subplots(2, rows, squeeze=False).T, runs, strict=True):
            draw_surfaces(pair, run)
    else:
        for one, run in zip(bottom.subplots(rows, 1, sharex=True, squeeze=False)[:, 0], runs, strict=True):
            draw_actuators(one, run)
            one.set_xlabel("time [s]")
            one.label_outer()
    figure.suptitle(title, fontsize=13, fontweight="bold")
    return figure


def _flight_overview(figure: SubFigure, runs: Sequence[View]) -> None:
    """Path, height and energy of flights, below one another."""
    path, flight = figure.subfigures(2, 1, height_ratios=(PATH_ROWS, FLIGHT_ROWS))
    rows = path.subplots(PATH_ROWS, 1)
    draw_flight_path(rows, runs)
    legend(rows[0], loc="best", ncols=1 + len(runs))
    draw_flight(flight.subplots(FLIGHT_ROWS, 1), runs)


def _rows(runs: Sequence[View]) -> int:
    """Strips over time that `draw_progress` fills."""
    return len(strips(runs)) + counting(runs)


def _trajectory(runs: Sequence[View]) -> Plot:
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


def _space_path(runs: Sequence[View]) -> Plot:
    figure = Figure(figsize=(WIDTH, space_height(runs)), layout="constrained")
    near = draw_space(figure, runs)
    caption = """
    Both views have one scale. Circles show the robot's outline along the way, the strokes inside the axes of its body:
    one that points at you looks short."""
    if counting(runs):
        caption += (
            " Numbered circles are the targets, as large as the tolerance; those that were reached are grey."
        )
    if any(result.target_moves for _, result in evaluated(runs)):
        caption += """ The goal moves: the dashed line is its path, the white dot its end. Below, the way as seen from
        the goal: bold is the closing window, the dashed circle is the tolerance."""
    elif near:
        caption += """ The white dot is the goal, as large as the tolerance; where an attitude is asked for, thin
        strokes are the wanted axes. Below, the last stretch: bold is the closing window, the dot is the end, the dashed
        circle is the tolerance."""
    return Plot("The path, seen from above and from the side", caption, figure)


def _flight_path(runs: Sequence[View]) -> Plot:
    figure = Figure(figsize=(WIDTH, 1.0 + 1.6 * PATH_ROWS), layout="constrained")
    rows = figure.subplots(PATH_ROWS, 1)
    draw_flight_path(rows, runs)
    legend(rows[0], loc="best", ncols=1 + len(runs))
    caption = """
    Each view has a scale of its own: a flight is much longer than it is wide or high."""
    return Plot("The path, seen from above and from the side", caption, figure)


def _flight(runs: Sequence[View]) -> Plot:
    figure = Figure(figsize=(WIDTH, 0.5 + 1.5 * FLIGHT_ROWS), layout="constrained")
    rows = figure.subplots(FLIGHT_ROWS, 1, sharex=True)
    draw_flight(rows, runs)
    legend(rows[0], loc="upper right", ncols=len(runs))
    caption = """
    The dashed line is the reference. Energy is the mean square of the throttles, added up: seconds at full throttle."""
    return Plot("Height and energy", caption, figure)


def _surfaces(runs: Sequence[View]) -> Plot:
    figure = Figure(figsize=(WIDTH, 3.8 * len(runs)), layout="constrained")
    rows = figure.subplots(2 * len(runs), 1, squeeze=False)[:, 0]
    for number, run in enumerate(runs):
        draw_surfaces(rows[2 * number : 2 * number + 2], run)
    caption = """
    A positive elevator lowers the nose, a positive aileron the right wing, and a positive rudder turns to the left."""
    return Plot("What surfaces and throttles did", caption, figure)


def _motion(runs: Sequence[View]) -> Plot:
    figure = Figure(figsize=(WIDTH, 0.5 + 1.4 * MOTION_ROWS), layout="constrained")
    rows = figure.subplots(MOTION_ROWS, 1, sharex=True)
    draw_motion(rows, runs)
    legend(rows[0], loc="upper right", ncols=len(runs))
    return Plot("How fast it moved and turned", "The turn rate counts about whatever axis it is.", figure)


def _progress(runs: Sequence[View]) -> Plot:
    count, counts = _rows(runs), counting(runs)
    figure = Figure(figsize=(WIDTH, 0.5 + 1.7 * count), layout="constrained")
    rows = figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0]
    draw_progress(rows, runs)
    legend(rows[0], loc="upper left" if counts else "upper right", ncols=len(runs))
    caption = "The scales of errors are logarithmic: each grid line is ten times the one below."
    if counts:
        return Plot("How many targets, and how far from the next", caption, figure)
    caption += """ To succeed, a line must stay below its dashed tolerance throughout the shaded window."""
    return Plot("How far from the goal", caption, figure)


def _actuators(runs: Sequence[View]) -> Plot:
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


def _use(runs: Sequence[View]) -> Plot:
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


def _supply(runs: Sequence[View]) -> Plot:
    figure = Figure(figsize=(WIDTH, 2.1), layout="constrained")
    axes = figure.subplots()
    draw_supply(axes, runs)
    legend(axes, loc="lower left", ncols=len(runs))
    caption = """
    As the gauge of the tank reports it. Below the dashed line, the pressure of the regulator, thrust falls with it."""
    return Plot(TITLE, caption, figure)


def _latency(runs: Sequence[View]) -> Plot:
    figure = Figure(figsize=(WIDTH, 2.7), layout="constrained")
    axes = figure.subplots()
    draw_latency(axes, runs)
    caption = """
    Time from sending a measurement to sending the command that answers it; the scale is logarithmic.
    The solid line is the median (p50); 99 of 100 commands come before the dashed one (p99)."""
    return Plot("How fast the controller answers", caption, figure)
