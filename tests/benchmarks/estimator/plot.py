"""Both estimators beside the truth: some seconds of velocity, and the errors as bars."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from fulmar_core.estimators.motion.settings import PlanarMotionSettings
from fulmar_core.robots.robot import Limits
from fulmar_evaluation.report.style import ALARM, INK, house_style, legend, quiet_grid
from tests.benchmarks.estimator.comparison import MEAN, RATES_HZ, WITH_IMU, Figures, estimate_by
from tests.benchmarks.estimator.drive import Drive

SHOWN_S = (3.0, 13.0)
COLOURS = {MEAN: ALARM, WITH_IMU: "#3b7ddd"}


def draw(
    drive: Drive, found: list[Figures], settings: PlanarMotionSettings, limits: Limits, latency_s: float
) -> Figure:
    """One drive as both estimate it, at each rate of poses."""
    with house_style():
        figure = Figure(figsize=(9.0, 5.6), layout="constrained")
        for axes, rate_hz in zip(figure.subplots(len(RATES_HZ), 1, sharex=True), RATES_HZ, strict=True):
            shown = (drive.time_s >= SHOWN_S[0]) & (drive.time_s <= SHOWN_S[1])
            time_s = drive.time_s[shown]
            for method, colour in COLOURS.items():
                estimates = estimate_by(method, drive, rate_hz, latency_s, settings, limits)
                row = next(r for r in found if (r.method, r.pose_rate_hz) == (method, rate_hz))
                label = f"{method}: {1e3 * row.velocity_rmse_m_s:.1f} mm/s off, {row.delay_ms:.0f} ms late"
                axes.plot(time_s, estimates[shown, 0], color=colour, label=label)
            axes.plot(time_s, drive.motion[shown, 0], color=INK, linewidth=0.9, label="truth")
            axes.set_ylabel("velocity along x [m/s]")
            axes.set_title(f"poses at {rate_hz:g} Hz", loc="left")
            quiet_grid(axes)
            top = float(np.nanmax(np.abs(drive.motion[shown, 0])))
            axes.set_ylim(-1.7 * top, 1.7 * top)
            legend(axes, loc="upper right", ncols=1)
        axes.set_xlabel("time [s]")
        return figure
