"""Returns of learners over processor time and over samples."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fulmar_evaluation.report.drawing import WIDTH
from fulmar_evaluation.report.page import Plot
from fulmar_evaluation.report.style import FAINT, colours, legend_over, quiet_grid

_WORDS = """
Mean return of 64 held-out episodes over processor time, and over samples; a line is the mean of the seeds, its band
reaches from the lowest to the highest. The dashed line is what closed valves are worth."""
AXES = (("cpu_s", "processor time [s]"), ("samples", "samples"))


def plots_of(learners: Mapping[str, Mapping[str, Any]]) -> list[Plot]:
    """Curves as thesis Fig. 6.2; none where nothing was measured."""
    present = {name: each for name, each in learners.items() if each.get("curves")}
    return [Plot("Learners", _WORDS, draw(present), "learners")] if present else []


def draw(learners: Mapping[str, Mapping[str, Any]]) -> Figure:
    """One panel for each budget."""
    figure = Figure(figsize=(WIDTH, 3.2), layout="constrained")
    shades = dict(zip(learners, colours(tuple(learners)), strict=True))
    for axes, (key, label) in zip(figure.subplots(1, 2, sharey=True), AXES, strict=True):
        for name, each in learners.items():
            _draw_learner(axes, each["curves"], key, shades[name], name)
        axes.axhline(next(iter(learners.values()))["closed_valves"], color=FAINT, linestyle="--")
        axes.set_xlabel(label)
        quiet_grid(axes)
        if key == "samples":
            axes.set_xscale("log")
        else:
            axes.set_ylabel("return")
            legend_over(axes)
    return figure


def _draw_learner(axes: Axes, curves: list[list[dict[str, float]]], key: str, shade: str, name: str) -> None:
    length = min(map(len, curves))
    place = np.mean([[point[key] for point in curve[:length]] for curve in curves], axis=0)
    value = np.array([[point["returns"] for point in curve[:length]] for curve in curves])
    axes.fill_between(place, value.min(0), value.max(0), color=shade, alpha=0.2, linewidth=0)
    axes.plot(place, value.mean(0), color=shade, marker=".", label=name)
