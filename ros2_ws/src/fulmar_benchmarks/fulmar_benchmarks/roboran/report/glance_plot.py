"""All pairs at a glance: our success, what is required, what the thesis reports."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from fulmar_benchmarks.roboran.cells import head
from fulmar_benchmarks.roboran.report.view import ROBOT_COLOURS
from fulmar_benchmarks.tables import display_name
from fulmar_evaluation.report.drawing import WIDTH, key, ring, share_axis
from fulmar_evaluation.report.style import ALARM, FAINT, INK, PAPER

_ROW = 0.27  # height of a row [inch]


def draw_glance(document: Mapping[str, Any]) -> Figure:
    """One row a pair, grouped by task."""
    groups = [
        (
            task,
            [
                entry
                for entry in document["pairs"]
                if entry["task"] == task and (entry["judged"] or entry["kind"] == "policy")
            ],
        )
        for task in dict.fromkeys(entry["task"] for entry in document["pairs"])
    ]
    groups = [(task, entries) for task, entries in groups if entries]
    count = sum(len(entries) + 1 for _, entries in groups)
    figure = Figure(figsize=(WIDTH, 1.0 + _ROW * count), layout="constrained")
    axes = figure.subplots()
    at, ticks, labels = 0.0, [], []
    for task, entries in groups:
        share = entries[0]["judged_figure"] == "share_of_bound"
        title = display_name(task) + (", share of the bound" if share else ", success")
        _write(axes, at, title, fontweight="bold")
        for entry in entries:
            at += 1.0
            ticks.append(at)
            labels.append(head(entry))
            _row(axes, at, entry)
        at += 1.0
    axes.set_ylim(at - 0.4, -0.6)
    low = _lowest(document)
    axes.set_xlim(low, 1.012)
    axes.set_yticks(ticks, labels)
    share_axis(axes, MaxNLocator(steps=[1, 2, 5, 10]))  # at whole percents, as they are printed
    key(figure, _KEY)
    return figure


def _lowest(document: Mapping[str, Any]) -> float:
    """Left end of the scale: a little below the lowest value, on a tenth."""
    values = [0.9]
    for entry in document["pairs"]:
        values += list(entry["judged"].values())
        if entry["thesis"]["success"] is not None and entry["judged_figure"] == "success_rate":
            values.append(entry["thesis"]["success"] - entry["thesis"]["success_std"])
    return max(math.floor(10.0 * min(values)) / 10.0, 0.0) - 0.012


def _row(axes: Any, at: float, entry: dict[str, Any]) -> None:
    colour = ROBOT_COLOURS.get(entry["robot"], INK)
    axes.axhline(at, color=FAINT, linewidth=0.5, alpha=0.35, zorder=1)
    if not entry["judged"]:
        box = {"facecolor": PAPER, "edgecolor": "none", "pad": 1.0}
        _write(axes, at, entry["status"], color=ALARM, fontsize=8.5, bbox=box)
    thesis = entry["thesis"]
    if thesis["success"] is not None and entry["judged_figure"] == "success_rate":
        low, high = thesis["success"] - thesis["success_std"], thesis["success"] + thesis["success_std"]
        axes.plot((max(low, 0.0), min(high, 1.0)), (at, at), color=FAINT, linewidth=5.0, alpha=0.35, zorder=2)
        axes.plot(thesis["success"], at, **ring(FAINT, markersize=6, zorder=3))
    for check in entry["verdicts"]:
        if check["name"] == "batch":
            axes.plot(check["limit"], at, "|", color=INK, markersize=11, markeredgewidth=1.6, zorder=4)
    if "mujoco" in entry["judged"]:
        look = {"markerfacecolor": "none", "markersize": 9.0, "zorder": 5}
        axes.plot(entry["judged"]["mujoco"], at, "D", color=colour, **look)
    if "batch" in entry["judged"]:
        axes.plot(entry["judged"]["batch"], at, "o", color=colour, markersize=6.5, zorder=5)


def _write(axes: Any, at: float, text: str, **look: Any) -> None:
    axes.text(0.008, at, text, transform=axes.get_yaxis_transform(), va="center", **look)


_KEY = [
    Line2D([], [], linestyle="", marker="o", color=INK, markersize=6.5, label="ours, batch"),
    Line2D([], [], **ring(marker="D", markersize=7, label="ours, MuJoCo")),
    Line2D([], [], linestyle="", marker="|", color=INK, markersize=11, markeredgewidth=1.6, label="required"),
    Line2D([], [], **ring(FAINT, linestyle="-", linewidth=4, alpha=0.7, label="thesis ± seeds")),
]
