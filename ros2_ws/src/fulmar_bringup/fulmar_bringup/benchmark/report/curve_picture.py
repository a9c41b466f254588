"""How fast policies learned."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from fulmar_bringup.benchmark.report.view import View, panels
from fulmar_bringup.benchmark.required import LEAST
from fulmar_bringup.report.style import DASHED, FAINT, INK, quiet_grid


def curves(run: View) -> list[list[dict[str, Any]]]:
    """Learning curves of a pair: of each seed the checks on held-out episodes, oldest first."""
    seeds = run.training.get("curves") or [run.training.get("curve")]
    return [curve for curve in seeds if isinstance(curve, list) and len(curve) > 1]


def draw_curves(runs: Sequence[View]) -> Figure:
    """Success on held-out episodes over wall-clock, of every seed that is known."""
    figure, axes = panels(runs, 2.9, sharey=True)
    for one, run in zip(axes[0], runs, strict=True):
        found = curves(run)
        for curve in found:
            wall_s = np.array([check["wall_s"] for check in curve])
            success = 100.0 * np.array([check["success_rate"] for check in curve])
            one.plot(wall_s, success, color=run.colour, linewidth=1.4, marker="o", markersize=2.4)
        if not found:
            one.text(0.5, 0.5, "no learning curve kept", ha="center", transform=one.transAxes, color=FAINT)
        least = LEAST.get(run.entry["task"], {}).get(run.entry["robot"])
        if least is not None and run.entry["judged_figure"] == "success_rate":
            one.axhline(100.0 * least, color=INK, linestyle=DASHED, linewidth=1.0)
        one.set_xlim(left=0.0)
        one.set_ylim(-2.0, 102.0)
        one.set_xlabel("wall-clock of training [s]")
        quiet_grid(one)
    axes[0, 0].set_ylabel("success when checked [%]")
    return figure
