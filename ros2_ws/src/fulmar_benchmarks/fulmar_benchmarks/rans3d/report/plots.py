"""Success at a glance, and errors over time."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from fulmar_benchmarks.rans3d.document import Key
from fulmar_benchmarks.rans3d.tables import robots_of
from fulmar_benchmarks.rans3d.targets import CONTROLLERS, NOMINAL, RANDOMISED
from fulmar_benchmarks.results import PairResult
from fulmar_benchmarks.tables import display_name
from fulmar_core.tasks import load_task
from fulmar_evaluation.report.drawing import (
    LENGTHS,
    WIDTH,
    bands,
    colour_lines,
    columns,
    key,
    limit_line,
    log_scale,
    share_axis,
)
from fulmar_evaluation.report.page import Plot
from fulmar_evaluation.report.style import FAINT, INK, colours, quiet_grid

_GLANCE = """
The further right, the better. A filled dot is the success in nominal episodes, a diamond the success under every
disturbance of `randomised`, among the episodes whose pose the linear programme can hold at all; the upright stroke is
what is required."""
_OVER_TIME = """
The median of all nominal episodes, with the band of nine in ten; the dashed line is the tolerance, or how many targets
make an episode a success. At track velocities the errors jump where a new target comes."""
COLOURS = dict(zip(CONTROLLERS, colours(CONTROLLERS), strict=True))
_ROW = 0.27  # height of a row [inch]
_PANEL, COLUMNS = 2.4, 3  # same of a panel over time, and how many lie side by side


def plots(document: Mapping[str, Any], outcomes: dict[Key, PairResult]) -> list[Plot]:
    """What is drawn of a document and its outcomes."""
    robots = robots_of(document)
    drawn = [Plot("At a glance", _GLANCE, draw_glance(document), "at_a_glance")] if robots else []
    return drawn + [
        Plot(
            f"{display_name(robot)} over time",
            _OVER_TIME,
            draw_over_time(robot, outcomes),
            f"{robot}_over_time",
        )
        for robot in robots
        if shown(robot, outcomes)
    ]


def draw_glance(document: Mapping[str, Any]) -> Figure:
    """One row for each controller at each task, one panel a robot."""
    robots = robots_of(document)
    rows = max(sum(1 + len(each) for each in tasks.values()) for tasks in robots.values())
    figure = Figure(figsize=(WIDTH, 1.0 + _ROW * rows), layout="constrained")
    panels = figure.subplots(1, len(robots), squeeze=False, sharey=False)[0]
    for axes, (robot, tasks) in zip(panels, robots.items(), strict=True):
        limits = {
            (line["task"], line["controller"]): line["limit"]
            for line in document["requirements"]
            if line.get("robot") == robot and not line["among_holdable"]
        }
        at, ticks, labels = 0.0, [], []
        for task, cells in tasks.items():
            axes.text(
                0.0,
                at,
                display_name(task),
                transform=axes.get_yaxis_transform(),
                va="center",
                fontweight="bold",
            )
            for name, cell in cells.items():
                at += 1.0
                ticks.append(at)
                labels.append(name)
                _row(axes, at, name, cell, limits.get((task, name)))
            at += 1.0
        axes.set_title(display_name(robot), loc="left")
        axes.set_ylim(at - 0.4, -0.6)
        low = _lowest(tasks)
        axes.set_xlim(low - 0.02 * (1.0 - low), 1.0 + 0.02 * (1.0 - low))
        axes.set_yticks(ticks, labels)
        share_axis(axes, MaxNLocator(5, steps=[1, 2, 5, 10]))
    key(figure, _KEY)
    return figure


def _row(axes: Axes, at: float, name: str, cell: dict[str, Any], limit: float | None) -> None:
    colour = COLOURS[name]
    axes.axhline(at, color=FAINT, linewidth=0.5, alpha=0.35, zorder=1)
    if cell["success_rate"] is None:
        middle = axes.get_yaxis_transform()
        axes.text(
            0.5, at, cell["status"], transform=middle, va="center", ha="center", color=FAINT, fontsize=8.5
        )
    held = _held(cell)
    if held is not None:
        axes.plot(
            held, at, "D", color=colour, markerfacecolor="none", markersize=8.0, zorder=5, clip_on=False
        )
    if cell["success_rate"] is not None:
        axes.plot(cell["success_rate"], at, "o", color=colour, markersize=5.0, zorder=6, clip_on=False)
    if limit is not None:
        axes.plot(limit, at, "|", color=INK, markersize=11, markeredgewidth=1.6, zorder=4)


def _held(cell: dict[str, Any]) -> float | None:
    """Success among the randomised episodes that can be held."""
    share: float | None = cell.get(RANDOMISED, {}).get("holdable", {}).get("success_rate")
    return share


def _lowest(tasks: dict[str, dict[str, Any]]) -> float:
    """Left end of the scale: a tenth at or below the lowest value, and below all that is required."""
    values = [0.9]
    for cells in tasks.values():
        for cell in cells.values():
            values += [share for share in (cell["success_rate"], _held(cell)) if share is not None]
    return math.floor(10.0 * min(values)) / 10.0


_KEY = [
    Line2D([], [], linestyle="", marker="o", color=INK, markersize=5, label="nominal"),
    Line2D(
        [], [], linestyle="", marker="D", color=INK, markerfacecolor="none", markersize=7,
        label="randomised, of those that can be held",
    ),
    Line2D([], [], linestyle="", marker="|", color=INK, markersize=11, markeredgewidth=1.6, label="required"),
]  # fmt: skip


def draw_over_time(robot: str, outcomes: dict[Key, PairResult]) -> Figure:
    """Distance, velocity error or targets reached over time, of the nominal episodes of one robot."""
    tasks = list(dict.fromkeys(place[1] for place in shown(robot, outcomes)))
    rows = math.ceil(len(tasks) / COLUMNS)
    figure, panels = columns(min(COLUMNS, len(tasks)), _PANEL * rows + 0.3, rows)
    for axes in panels.flat[len(tasks) :]:
        axes.set_visible(False)
    drawn: set[str] = set()
    for axes, task in zip(panels.flat, tasks, strict=False):
        found = {
            name: outcomes[robot, task, name, NOMINAL]
            for name in CONTROLLERS
            if (robot, task, name, NOMINAL) in outcomes
        }
        _over_time(axes, task, found)
        axes.set_title(display_name(task), loc="left")
        drawn |= set(found)
    key(figure, colour_lines({name: COLOURS[name] for name in CONTROLLERS if name in drawn}))
    return figure


def _over_time(axes: Axes, task: str, found: dict[str, PairResult]) -> None:
    its = load_task(task)
    for name, outcome in found.items():
        time_s = outcome.about["control_dt"] * np.arange(1, outcome.over_time.shape[1] + 1)
        bands(axes, time_s, outcome.over_time, COLOURS[name], half=False)
    quiet_grid(axes)
    axes.set_xlabel("time [s]")
    if its.required is not None:
        limit_line(axes, its.required, "required")
        axes.set_ylim(bottom=0.0)
        axes.yaxis.set_major_locator(MaxNLocator("auto", integer=True))
        axes.set_ylabel("targets reached")
    elif its.tolerance.position:
        limit_line(axes, its.tolerance.position)
        log_scale(axes.yaxis, LENGTHS)
        axes.set_ylim(1e-3, 12.0)
        axes.set_ylabel("distance")
    else:
        limit_line(axes, its.tolerance.velocity)
        axes.set_ylim(bottom=0.0)
        axes.set_ylabel("velocity error [m/s]")


def shown(robot: str, outcomes: dict[Key, PairResult]) -> Sequence[Key]:
    """The outcomes that `draw_over_time` has of a robot."""
    return [place for place in outcomes if place[0] == robot and place[3] == NOMINAL]
