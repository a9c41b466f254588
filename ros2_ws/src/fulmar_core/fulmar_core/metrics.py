"""How runs are judged: errors, dwell percentages, effort, success.

PT, OT, ALV, AAV and AAS are the figures of DRIFT (thesis Table 3.5) as defined in RANS `utils/eval_metrics.py`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.state import Pose, RigidBodyState, stack_poses, stack_states
from fulmar_core.tasks import Task
from fulmar_core.tasks.planar import planar_error


@dataclass(frozen=True)
class Trajectories:
    """What happened after each control step of some episodes of equal length."""

    position_error: np.ndarray  # (episodes, steps) [m]
    heading_error: np.ndarray  # (episodes, steps) [rad]
    speed: np.ndarray  # (episodes, steps) [m/s]
    yaw_rate: np.ndarray  # (episodes, steps) [rad/s]
    actuators_in_use: np.ndarray  # (episodes, steps) share of actuators with a non-zero command [-]
    control_dt: float  # [s]


COLUMNS = ("position_error", "heading_error", "speed", "yaw_rate", "actuators_in_use")


class TrajectoryLog:
    """Collects steps of one episode or of a batch; the figures are computed when asked for."""

    def __init__(self, control_dt: float) -> None:
        """Begin empty; `control_dt` in seconds."""
        self._control_dt = control_dt
        self._truths: list[RigidBodyState] = []
        self._goals: list[Pose] = []
        self._commands: list[np.ndarray] = []

    def add(self, truth: RigidBodyState, goal: Pose, command: np.ndarray) -> None:
        """Note one control step.

        Args:
            truth: True state after the step, leading shape () or (episodes,); must not change later.
            goal: Goals, same leading shape; must not change later.
            command: What was applied, shape (n,) or (episodes, n); must not change later.
        """
        self._truths.append(truth)
        self._goals.append(goal)
        self._commands.append(command)

    def trajectories(self) -> Trajectories:
        """Everything noted so far."""
        truth, goal = stack_states(self._truths), stack_poses(self._goals)
        error = planar_error(truth, goal)
        columns = (
            error.position,
            error.heading,
            np.linalg.norm(truth.velocity_in_world, axis=-1),
            truth.angular_velocity_in_body[..., 2],
            np.mean(np.stack(self._commands) != 0.0, axis=-1),
        )
        by_name = {name: np.atleast_2d(column.T) for name, column in zip(COLUMNS, columns, strict=True)}
        return Trajectories(**by_name, control_dt=self._control_dt)


def join(runs: list[Trajectories]) -> Trajectories:
    """One set of trajectories out of several of equal length and rate."""
    arrays = {name: np.concatenate([getattr(run, name) for run in runs]) for name in COLUMNS}
    return Trajectories(**arrays, control_dt=runs[0].control_dt)


def select(run: Trajectories, episodes: np.ndarray) -> Trajectories:
    """Some episodes of a set, in the order of their indices."""
    arrays = {name: getattr(run, name)[episodes] for name in COLUMNS}
    return Trajectories(**arrays, control_dt=run.control_dt)


def successes(run: Trajectories, task: Task) -> np.ndarray:
    """Which episodes stayed inside the task's tolerance for the whole closing window.

    Args:
        run: What happened.
        task: Has the tolerance and the window.

    Returns:
        One truth value an episode, shape (episodes,).
    """
    window = max(1, round(task.tolerance.hold_s / run.control_dt))
    return np.asarray(np.all(_inside(run, task)[:, -window:], axis=1))


def episode_metrics(run: Trajectories, task: Task) -> dict[str, np.ndarray]:
    """Every figure of every episode.

    Args:
        run: What happened.
        task: Has the tolerance that `time_to_target_s` is measured against.

    Returns:
        Arrays of shape (episodes,), by name. `time_to_target_s` is the time from which an episode stays inside
        the tolerance to its end, NaN where it never does.
    """
    degrees = np.abs(np.rad2deg(run.heading_error))
    figures = {
        "final_position_error_m": run.position_error[:, -1],
        "final_heading_error_deg": degrees[:, -1],
        "time_to_target_s": _time_to_target(run, task),
    }
    for centimetres in (5, 2, 1):
        figures[f"PT{centimetres}_percent"] = 100.0 * np.mean(run.position_error < 0.01 * centimetres, axis=1)
    for limit in (5, 2, 1):
        figures[f"OT{limit}_percent"] = 100.0 * np.mean(degrees < limit, axis=1)
    figures["ALV_m_s"] = np.mean(run.speed, axis=1)
    figures["AAV_rad_s"] = np.mean(np.abs(run.yaw_rate), axis=1)
    figures["AAS"] = np.mean(run.actuators_in_use, axis=1)
    return figures


def summary(run: Trajectories, task: Task) -> dict[str, Any]:
    """Success rate, and mean, median and 95th percentile of every figure, JSON-ready.

    Figures that no episode has (the time to a target that was never reached) are None.
    """
    statistics: dict[str, Any] = {
        "episodes": int(run.position_error.shape[0]),
        "success_rate": float(np.mean(successes(run, task))),
    }
    for name, values in episode_metrics(run, task).items():
        known = values[np.isfinite(values)]
        statistics[name] = {
            "mean": float(np.mean(known)) if known.size else None,
            "median": float(np.median(known)) if known.size else None,
            "p95": float(np.percentile(known, 95)) if known.size else None,
        }
    return statistics


def _inside(run: Trajectories, task: Task) -> np.ndarray:
    near = run.position_error < task.tolerance.position
    return np.asarray(near & (np.abs(np.rad2deg(run.heading_error)) <= task.tolerance.heading_deg))


def _time_to_target(run: Trajectories, task: Task) -> np.ndarray:
    stays = np.flip(np.logical_and.accumulate(np.flip(_inside(run, task), axis=1), axis=1), axis=1)
    first = np.argmax(stays, axis=1)
    return np.where(stays[:, -1], (first + 1) * run.control_dt, np.nan)
