"""How fast policies learned."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from fulmar_benchmarks.roboran.report.view import View, panels
from fulmar_benchmarks.roboran.targets import LEAST
from fulmar_evaluation.report.style import DASHED, INK, quiet_grid


def curve_of(run: View) -> list[dict[str, Any]]:
    """Learning curve of a pair, as its passport holds it: checks on held-out episodes, oldest first."""
    curve = run.training.get("curve")
    return curve if isinstance(curve, list) and len(curve) > 1 else []


def draw_curves(runs: Sequence[View]) -> Figure:
    """Success on held-out episodes over wall-clock."""
    figure, axes = panels(runs, 2.9, sharey=True)
    for one, run in zip(axes[0], runs, strict=True):
        curve = curve_of(run)
        wall_s = np.array([check["wall_s"] for check in curve])
        success = 100.0 * np.array([check["success_rate"] for check in curve])
        one.plot(wall_s, success, color=run.colour, linewidth=1.4, marker="o", markersize=2.4)
        least = LEAST.get(run.entry["task"], {}).get(run.entry["robot"])
        if least is not None and run.entry["judged_figure"] == "success_rate":
            one.axhline(100.0 * least, color=INK, linestyle=DASHED, linewidth=1.0)
        one.set_xlim(left=0.0)
        one.set_ylim(-2.0, 102.0)
        one.set_xlabel("wall-clock of training [s]")
        quiet_grid(one)
    axes[0, 0].set_ylabel("success when checked [%]")
    return figure
