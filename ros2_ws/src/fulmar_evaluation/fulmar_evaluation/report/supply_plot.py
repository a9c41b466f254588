"""Pressure of the gas supply over time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from fulmar_evaluation.report.run_view import View, evaluated
from fulmar_evaluation.report.style import quiet_grid

PASCAL_PER_BAR = 1e5
TITLE = "Pressure of the supply"


def draw_supply(axes: Axes, runs: Sequence[View]) -> None:
    """One line for each run with a gauge, and a dashed one where thrust begins to fall."""
    for run in runs:
        if len(run.record.supply):
            stamps = run.record.supply.stamp_s
            begin_s = float(run.record.motion.stamp_s[0]) if len(run.record.motion) else float(stamps[0])
            draw_pressure(axes, stamps - begin_s, run.record.supply.pascal, run.colour, run.label)
    for regulated in {pressure for run in runs for pressure in _regulated(run)}:
        bar = regulated / PASCAL_PER_BAR
        axes.axhline(bar, color="0.5", ls="--", lw=0.9)
        axes.annotate(
            f"regulator {bar:g} bar", (1.0, bar), xycoords=axes.get_yaxis_transform(), fontsize=8.5,
            xytext=(-2.0, 2.0), textcoords="offset points", ha="right", va="bottom",
        )  # fmt: skip
    axes.set_xlim(0.0, max((result.duration_s for _, result in evaluated(runs)), default=None))


def draw_pressure(axes: Axes, time_s: np.ndarray, pascal: np.ndarray, colour: str, label: str = "") -> None:
    """One line of pressures [Pa] over time [s], in bar."""
    axes.plot(time_s, pascal / PASCAL_PER_BAR, color=colour, lw=1.1, label=label)
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("pressure [bar]")
    quiet_grid(axes)


def _regulated(run: View) -> list[float]:
    """Pressure below which thrust falls [Pa]; none where no tank is described."""
    tank = None if run.result is None else run.result.robot.actuators.tank
    return [] if tank is None else [float(tank.regulated)]
