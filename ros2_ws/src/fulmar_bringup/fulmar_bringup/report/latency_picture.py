"""How long the controller took to answer."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from fulmar_bringup.report.style import DASHED, quiet_grid
from fulmar_bringup.report.view import View
from fulmar_bringup.run_summary import percentiles

BINS = 48
SHORTEST_MS = 0.01


def draw_latency(axes: Axes, runs: Sequence[View]) -> None:
    """Share of commands by the time from sending a measurement to sending its answer, with p50 and p99.

    The scale is logarithmic, because a few answers take ten times as long as most.
    """
    known = [(run, np.maximum(run.latencies_ms, SHORTEST_MS)) for run in runs if run.latencies_ms.size]
    if not known:
        axes.text(0.5, 0.5, "no command answers a recorded odometry", ha="center", transform=axes.transAxes)
        return
    shortest = min(float(latency.min()) for _, latency in known)
    longest = max(float(latency.max()) for _, latency in known)
    bins = np.geomspace(0.8 * shortest, 1.25 * longest, BINS)
    for run, latency in known:
        share = np.full(latency.size, 100.0 / latency.size)
        spread = percentiles(run.latencies_ms)
        label = f"{run.label}: p50 {spread['p50']:.2g} ms, p99 {spread['p99']:.2g} ms"
        axes.hist(latency, bins, weights=share, color=run.colour, alpha=0.22, histtype="stepfilled")
        axes.hist(latency, bins, weights=share, color=run.colour, histtype="step", label=label)
        axes.axvline(spread["p50"], color=run.colour, linewidth=1.2)
        axes.axvline(spread["p99"], color=run.colour, linewidth=1.2, linestyle=DASHED)
    quiet_grid(axes)
    axes.set_xscale("log")
    axes.set_xlim(bins[0], bins[-1])
    axes.xaxis.set_major_locator(LogLocator(10.0, subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_xlabel("from measurement sent to command sent [ms]")
    axes.set_ylabel("commands [%]")
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), fontsize=8.5, handlelength=1.2)
