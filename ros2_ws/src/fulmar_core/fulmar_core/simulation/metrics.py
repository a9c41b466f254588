"""Metrics of runs: success, errors, times, dwell percentages, effort. `figures.FIGURES` says what each means.

PT, OT, ALV, AAV and AAS are the figures of DRIFT (thesis Table 3.5) as defined in RANS `utils/eval_metrics.py`;
success, times, velocity errors, goals and control variation are those of thesis Tables 4.5 and 4.7. All are computed
from true states.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fulmar_core.simulation.trajectories import (
    TargetCounter,
    Trajectories,
    TrajectoryLog,
    first_steps,
    join,
    select,
)
from fulmar_core.tasks import Task
from fulmar_core.tasks.terms import Errors

__all__ = [
    "TargetCounter",
    "Trajectories",
    "TrajectoryLog",
    "episode_metrics",
    "first_steps",
    "join",
    "select",
    "successes",
    "summarise",
    "summary",
]


# Of some figures what the worst moment of all episodes had: name, key, figure that it is the extreme of, and which.
EXTREMES: dict[str, tuple[str, str, Callable[[np.ndarray], Any]]] = {
    "path_error_m": ("max", "path_error_most_m", np.max),
    "least_distance_m": ("min", "least_distance_m", np.min),
}


def successes(run: Trajectories, task: Task) -> np.ndarray:
    """Which episodes succeeded, shape (episodes,).

    An episode succeeds if it stayed inside every tolerance of the task for the whole closing window, or, where the
    task counts targets, if it reached as many as are required; and if it touched nothing on its way.
    """
    clean = ~np.any(run.touching, axis=1)
    if task.required is not None:
        return np.asarray(clean & (run.goals[:, -1] >= task.required))
    return np.asarray(clean & np.all(_inside(run, task)[:, -_window(run, task) :], axis=1))


def counts_targets(task: Task) -> bool:
    """Whether a task is about how many targets one reaches."""
    return task.required is not None


def episode_metrics(run: Trajectories, task: Task) -> dict[str, np.ndarray]:
    """Every figure of every episode.

    Returns:
        Arrays of shape (episodes,) by the names of `figures.FIGURES`; NaN where an episode has no such figure, as the
        time to a target that it never held. A figure that the task does not ask for is left out.
    """
    figures: dict[str, np.ndarray] = {}
    counts, tracks = counts_targets(task), _asked(run.velocity_error)
    inside = _inside(run, task)
    if not counts and _asked(run.position_error):
        figures["final_position_error_m"] = run.position_error[:, -1]
    turned = _turned(run)
    if not counts and _asked(turned):
        kind = "heading" if run.attitude_error is None else "attitude"
        figures[f"final_{kind}_error_deg"] = np.rad2deg(turned[:, -1])
    if counts:
        figures["goals_reached"] = run.goals[:, -1]
        figures["time_to_first_goal_s"] = _first(run.goals >= 1.0, run)
    elif tracks:
        figures["velocity_error_m_s"] = _mean(run.velocity_error)
        kind = "yaw_rate" if run.rate_error is None else "rate"
        figures[f"{kind}_error_deg_s"] = np.rad2deg(_mean(_rate_error(run)))
        figures["settling_time_s"], figures["targets_held_percent"] = _by_target(inside, run, task)
    else:
        figures["time_to_target_s"] = _time_to_target(inside, run)
        figures["first_inside_s"] = _first(inside, run)
    if not counts:
        figures["inside_percent"] = 100.0 * _mean(inside)
    if not counts and _asked(run.position_error):
        for centimetres in (5, 2, 1):
            figures[f"PT{centimetres}_percent"] = 100.0 * _mean(run.position_error < 0.01 * centimetres)
    if not counts and _asked(turned):
        for degrees in (5, 2, 1):
            figures[f"OT{degrees}_percent"] = 100.0 * _mean(np.rad2deg(turned) < degrees)
    figures |= _beside(run, task)
    figures["ALV_m_s"] = _mean(run.speed)
    figures["AAV_rad_s"] = _mean(np.abs(run.yaw_rate))
    figures["AAS"] = _mean(run.actuators_in_use)
    figures["effort"] = _mean(run.effort)
    if run.thrust is not None:
        figures["impulse_N_s"] = np.asarray(run.control_dt * np.sum(run.thrust, axis=1, dtype=np.float64))
        figures["fuel_used_kg"] = figures["impulse_N_s"] / run.exhaust_speed
    figures["control_variation"] = _mean(run.variation)
    figures["control_deviation"] = np.mean(np.std(run.shares, axis=1, dtype=np.float64), axis=-1)
    figures["collided"] = np.any(run.touching, axis=1).astype(float)
    figures["left_the_geofence"] = np.any(run.outside, axis=1).astype(float)
    figures["thesis_success"] = _thesis_successes(run, task).astype(float)
    return figures


def _beside(run: Trajectories, task: Task) -> dict[str, np.ndarray]:
    """Figures of targets that move, and of things in space."""
    figures = {}
    if task.moves:
        figures["path_error_m"] = _mean(run.position_error)
        figures["path_error_most_m"] = np.max(run.position_error, axis=1)
    if run.keep_out_distance is not None:
        figures["least_distance_m"] = np.min(run.keep_out_distance, axis=1)
    if run.pointing_error is not None and _asked(run.pointing_error):
        figures["pointing_error_deg"] = np.rad2deg(_mean(run.pointing_error))
        figures["coverage"] = np.full(len(run.x), np.nan)
    return figures


def summary(run: Trajectories, task: Task) -> dict[str, Any]:
    """Success rate, and mean, median and 95th percentile of every figure, JSON-ready; see `summarise`."""
    return summarise(successes(run, task), episode_metrics(run, task))


def summarise(succeeded: np.ndarray, figures: dict[str, np.ndarray]) -> dict[str, Any]:
    """The statistics of some episodes.

    Args:
        succeeded: Of `successes`, shape (episodes,).
        figures: Of `episode_metrics`.

    Returns:
        Number of episodes and success rate; mean, median and 95th percentile of every figure. A figure that no episode
        has (the time to a target that was never reached) is None. Those of `EXTREMES` have their worst value, too.
    """
    statistics: dict[str, Any] = {"episodes": len(succeeded), "success_rate": float(np.mean(succeeded))}
    for name, values in figures.items():
        known = np.asarray(values, dtype=float)
        known = known[np.isfinite(known)]
        statistics[name] = {
            "mean": float(np.mean(known)) if known.size else None,
            "median": float(np.median(known)) if known.size else None,
            "p95": float(np.percentile(known, 95)) if known.size else None,
        }
    for name, (worst, of, which) in EXTREMES.items():
        if name in statistics:
            known = np.asarray(figures[of], dtype=float)
            known = known[np.isfinite(known)]
            statistics[name][worst] = float(which(known)) if known.size else None
    return statistics


def _mean(column: np.ndarray) -> np.ndarray:
    """Mean over time, shape (episodes,)."""
    return np.asarray(np.mean(column, axis=1, dtype=np.float64))


def _asked(column: np.ndarray) -> bool:
    return not bool(np.isnan(column[:1, :1]).all())


def _turned(run: Trajectories) -> np.ndarray:
    """Size of the heading error, or in space the attitude error, shape (episodes, steps) [rad]."""
    return np.abs(run.heading_error) if run.attitude_error is None else run.attitude_error


def _rate_error(run: Trajectories) -> np.ndarray:
    """Size of the turn rate's error, shape (episodes, steps) [rad/s]."""
    return np.abs(run.yaw_rate_error) if run.rate_error is None else run.rate_error


def _window(run: Trajectories, task: Task) -> int:
    """Control steps of the closing window."""
    return max(1, round(task.tolerance.hold_s / run.control_dt))


def _inside(run: Trajectories, task: Task) -> np.ndarray:
    """Where an episode is inside every tolerance that the task has, shape (episodes, steps)."""
    errors = Errors(
        run.position_error,
        run.heading_error,
        run.velocity_error,
        run.yaw_rate_error,
        run.attitude_error,
        run.rate_error,
    )
    return task.tolerance.holds(errors)


def _first(there: np.ndarray, run: Trajectories) -> np.ndarray:
    """Time of the first step at which something holds, NaN where it never does, shape (episodes,) [s]."""
    return np.where(np.any(there, axis=1), (np.argmax(there, axis=1) + 1) * run.control_dt, np.nan)


def _time_to_target(inside: np.ndarray, run: Trajectories) -> np.ndarray:
    """Time from which an episode stays inside to its end, NaN where it does not, shape (episodes,) [s]."""
    stays = np.flip(np.logical_and.accumulate(np.flip(inside, axis=1), axis=1), axis=1)
    return _first(stays, run)


def _by_target(inside: np.ndarray, run: Trajectories, task: Task) -> tuple[np.ndarray, np.ndarray]:
    """Settling time [s], and share of targets that were held to their end [%], shapes (episodes,).

    Targets whose time was shorter than the closing window do not count, as one that comes with the last step.
    """
    episodes, steps = inside.shape
    last = np.diff(run.goals, axis=1, append=run.goals[:, -1:] - 1.0) != 0.0
    window = _window(run, task)
    settling, held, targets, lasted, stayed = (np.zeros(episodes) for _ in range(5))
    stays = np.ones(episodes, dtype=bool)
    # From the last step to the first: what stays inside is known from the end of each target.
    for step in range(steps - 1, -2, -1):
        over = last[:, step] if step >= 0 else np.ones(episodes, dtype=bool)
        counts = over & (lasted >= window)
        settling += np.where(counts, lasted - stayed, 0.0)
        held += counts & (stayed >= window)
        targets += counts
        if step >= 0:
            stays = (stays | over) & inside[:, step]
            lasted = np.where(over, 0.0, lasted) + 1.0
            stayed = np.where(over, 0.0, stayed) + stays
    targets[targets == 0.0] = np.nan
    return settling * run.control_dt / targets, 100.0 * held / targets


def _thesis_successes(run: Trajectories, task: Task) -> np.ndarray:
    """Success as the thesis words it (§4.4.1), shape (episodes,)."""
    if counts_targets(task):
        return np.asarray(run.goals[:, -1] >= 1.0)
    if _asked(run.velocity_error):
        slow = _mean(run.velocity_error) <= task.tolerance.velocity
        limit_deg = task.tolerance.yaw_rate_deg if run.rate_error is None else task.tolerance.rate_deg
        steady = _mean(_rate_error(run)) <= np.deg2rad(limit_deg)
        return np.asarray(slow & steady)
    return np.asarray(_inside(run, task)[:, -1])
