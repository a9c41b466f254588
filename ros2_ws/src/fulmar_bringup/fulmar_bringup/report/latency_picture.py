"""How long the controller took to answer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from fulmar_bringup.report.style import DASHED, quiet_grid
from fulmar_bringup.report.view import View
from fulmar_bringup.run_summary import percentiles

BINS = 40


def draw_latency(axes: Axes, runs: Sequence[View]) -> None:
    """Share of commands by the time from measurement to answer, with p50 and p99."""
    known = [run for run in runs if run.latencies_ms.size]
    if not known:
        axes.text(0.5, 0.5, "no command answers a recorded odometry", ha="center", transform=axes.transAxes)
        return
    widest = max(float(np.percentile(run.latencies_ms, 99.5)) for run in known)
    bins = np.linspace(0.0, 1.15 * widest, BINS)
    for run in known:
        share = np.full(run.latencies_ms.size, 100.0 / run.latencies_ms.size)
        inside = np.minimum(run.latencies_ms, bins[-1])  # the last bar stands for all that is longer
        axes.hist(inside, bins, weights=share, color=run.colour, alpha=0.22, histtype="stepfilled")
        axes.hist(inside, bins, weights=share, color=run.colour, histtype="step", label=run.label)
    quiet_grid(axes)
    axes.set_ylim(top=1.35 * axes.get_ylim()[1])
    axes.set_xlim(0.0, bins[-1])
    for name, line in (("p50", "-"), ("p99", DASHED)):
        _mark(axes, known, name, line)
    axes.set_xlabel("from measurement to command [ms]")
    axes.set_ylabel("commands [%]")


def _mark(axes: Axes, runs: Sequence[View], name: str, line: Any) -> None:
    """A line for each run at one percentile; the smallest has its name to the left, where no other is."""
    values = sorted((percentiles(run.latencies_ms)[name], run.colour) for run in runs)
    for order, (value, colour) in enumerate(values):
        axes.axvline(value, color=colour, linestyle=line, linewidth=1.2)
        axes.annotate(
            f"{name} {value:.2g} ms",
            xy=(value, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(-3 if order == 0 else 3, -2 - 12 * max(0, order - 1)),
            textcoords="offset points",
            ha="right" if order == 0 else "left",
            va="top",
            fontsize=8.5,
            color=colour,
        )
