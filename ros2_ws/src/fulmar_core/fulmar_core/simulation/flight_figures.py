"""Figures of flights along a reference: errors per axis, altitude, settling, energy and survival, from true states."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.trajectories import Trajectories
from fulmar_core.tasks.references.flight_paths import PATHS, Profile

SETTLED_M = 0.1  # a flight has settled once it stays so near to its reference
WITHOUT_START_S = 10.0  # after which `late_altitude_rmse_m` counts


def reference(task: str) -> tuple[Profile, Profile]:
    """Place to the left and height [m] over time [s] of what a task follows."""
    return PATHS.get(task, (lambda t: 0.0 * t, lambda t: 1.0 + 0.0 * t))


def flight_figures(run: Trajectories, task: str, robot: Robot) -> dict[str, Any]:
    """Figures of some flights: medians over those that survive, and the share that does.

    Altitude RMSE is over all flights that survive together. Energy is the mean squared throttle [-]; added up over
    time, per metre, it is `energy_per_m` [s/m].
    Per axis and over all: √(mean ‖e‖² / 3) and √(mean ‖e‖²) of the way to the reference, of which that ahead is 0.
    """
    error = np.asarray(run.position_error, dtype=float)
    times = run.control_dt * np.arange(1, error.shape[1] + 1)
    off = np.asarray(run.z, dtype=float) - reference(task)[1](times)
    alive = ~np.any(run.touching, axis=1)
    rmse = np.sqrt(np.mean(error**2, axis=1))
    throttles = np.asarray(run.shares)[..., robot.actuators.positions :]
    near = np.flip(np.logical_and.accumulate(np.flip(error <= SETTLED_M, axis=1), axis=1), axis=1)
    settled = np.where(near.any(axis=1), np.argmax(near, axis=1) * run.control_dt, np.inf)
    late = times > WITHOUT_START_S

    def pooled(squares: np.ndarray) -> float | None:
        return float(np.sqrt(np.mean(squares[alive]))) if alive.any() and squares.size else None

    def median(values: np.ndarray) -> float | None:
        middle = float(np.median(values[alive])) if alive.any() else math.inf
        return middle if math.isfinite(middle) else None

    peak = median(error.max(axis=1))
    return {
        "rmse_per_axis_m": median(rmse / np.sqrt(3.0)),
        "rmse_per_axis_worst_m": float(rmse[alive].max() / np.sqrt(3.0)) if alive.any() else None,
        "rmse_m": median(rmse),
        "altitude_rmse_m": pooled(off**2),
        "late_altitude_rmse_m": pooled(off[:, late] ** 2),
        "settling_s": median(settled),
        "peak_error_m": peak,
        "overshoot_m": peak,  # as the thesis calls it
        "energy": median(np.mean(throttles**2, axis=(1, 2))),
        "energy_per_m": median(np.mean(throttles**2, axis=(1, 2)) / np.mean(run.speed, axis=1)),
        "survival": float(np.mean(alive)),
        "episodes": len(alive),
    }
