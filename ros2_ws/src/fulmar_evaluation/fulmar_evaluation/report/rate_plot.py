"""Turn rates over time about the body's axes, with their standard deviations as bands."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from fulmar_evaluation.event_rates import Rates
from fulmar_evaluation.report.style import BODY_AXES, house_style, quiet_grid

SIGMAS = 1.96  # of a band: 95 %


def write_rate_plot(rates: Rates, path: Path) -> None:
    """Draw the rates of every window into a file; its ending says of which kind.

    Raises:
        OSError: It cannot be written.
        ValueError: Matplotlib knows no such ending.
    """
    with house_style():
        figure = Figure(figsize=(7.2, 4.2), layout="constrained")
        degrees, spread = np.degrees(rates.rates), SIGMAS * np.degrees(rates.stds)
        for axes, axis, colour, value, band in zip(
            figure.subplots(3, 1, sharex=True), "xyz", BODY_AXES, degrees.T, spread.T, strict=True
        ):
            axes.fill_between(
                rates.times_s, value - band, value + band, color=colour, alpha=0.25, linewidth=0
            )
            axes.plot(rates.times_s, value, color=colour, marker=".", markersize=3.0, linewidth=0.8)
            axes.set_ylabel(f"about {axis} [°/s]")
            quiet_grid(axes)
        axes.set_xlabel("time [s]")
        figure.savefig(path, dpi=150)
