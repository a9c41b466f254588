"""All conditions at a glance: our means, what is required, what is published, and the bound."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fulmar_benchmarks.drift.cells import spoken
from fulmar_evaluation.report.drawing import WIDTH, key, ring
from fulmar_evaluation.report.style import FAINT, INK, colours, quiet_grid

SHOWN = ("PT5", "PT2", "PT1", "OT5")
_APART = 0.34  # between the controllers of one row, of the distance of two rows


def draw_glance(document: dict[str, Any]) -> Figure | None:
    """One row a condition, one column a figure; None where no condition has a result."""
    rows = {
        name: row
        for name, row in document["rows"].items()
        if row["kind"] == "pose" and any(entry["figures"] for entry in row["controllers"].values())
    }
    if not rows:
        return None
    names = document["controllers"]
    figure = Figure(figsize=(WIDTH, 1.1 + (0.16 + 0.17 * len(names)) * len(rows)), layout="constrained")
    axes = figure.subplots(1, len(SHOWN), sharey=True)
    asked = {
        (check["row"], check["controller"], check["figure"]): check["limit"]
        for check in document["requirements"]
    }
    shade = colours(names)
    for one, shown in zip(axes, SHOWN, strict=True):
        for at, (row, known) in enumerate(rows.items()):
            one.axhspan(at - 0.5, at + 0.5, color=FAINT, alpha=0.09 * (at % 2), linewidth=0)
            if shown in known["bound"]:
                most = known["bound"][shown]["mean"]
                one.plot([most] * 2, [at - 0.45, at + 0.45], color=FAINT, linewidth=1.2)
            for index, (name, colour) in enumerate(zip(names, shade, strict=True)):
                y = at + _APART * (index - 0.5 * (len(names) - 1)) * 2.0 / max(len(names), 2)
                _mark(one, y, known["controllers"][name], shown, colour, asked.get((row, name, shown)))
        one.set_title(f"{shown} [%]", loc="left")
        one.set_xlim(-3.0, 103.0)
        quiet_grid(one)
        one.grid(False, axis="y")
    axes[0].set_yticks(range(len(rows)), [row["title"] for row in rows.values()])
    axes[0].set_ylim(len(rows) - 0.5, -0.5)
    for one in axes:
        one.tick_params(axis="y", length=0.0)
    key(figure, _key(names, shade), most=len(names) + 3)
    return figure


def _mark(axes: Axes, y: float, entry: dict[str, Any], figure: str, colour: str, limit: float | None) -> None:
    axes.plot(entry["published"][figure], y, **ring(colour, markersize=4.5, alpha=0.8))
    if entry["figures"]:
        ours = entry["figures"][figure]
        axes.plot([ours["p5"], ours["p95"]], [y, y], color=colour, linewidth=1.0, alpha=0.35)
        axes.plot(ours["mean"], y, "o", color=colour, markersize=5.0, zorder=5)
    if limit is not None:
        axes.plot(limit, y, "|", color=INK, markersize=9.0, markeredgewidth=1.4, zorder=6)


def _key(names: list[str], shade: list[str]) -> list[Line2D]:
    lines = [
        Line2D([], [], color=colour, marker="o", linestyle="", label=spoken(name))
        for name, colour in zip(names, shade, strict=True)
    ]
    return [
        *lines,
        Line2D([], [], **ring(label="published")),
        Line2D([], [], linestyle="", color=INK, marker="|", markersize=9.0, label="required"),
        Line2D([], [], color=FAINT, label="bound"),
    ]
