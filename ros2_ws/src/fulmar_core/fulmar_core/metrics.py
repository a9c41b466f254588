"""How runs are judged: errors, dwell percentages, effort, success.

PT, OT, ALV, AAV and AAS are the figures of DRIFT (thesis Table 3.5) as defined in RANS `utils/eval_metrics.py`; success,
velocity errors, goals and control variation are those of thesis Tables 4.5 and 4.7. All are judged from true states.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.goal import Goal
from fulmar_core.planar import PlanarState, stack_planar
from fulmar_core.robot import Robot
from fulmar_core.tasks import Task


@dataclass(frozen=True)
class Trajectories:
    """What happened after each control step of some episodes of equal length; NaN where a task does not ask."""

    x: np.ndarray  # (episodes, steps) [m]
    y: np.ndarray  # (episodes, steps) [m]
    position_error: np.ndarray  # (episodes, steps) [m]
    heading_error: np.ndarray  # (episodes, steps) [rad]
    velocity_error: np.ndarray  # (episodes, steps) [m/s]
    yaw_rate_error: np.ndarray  # (episodes, steps) [rad/s]
    speed: np.ndarray  # (episodes, steps) [m/s]
    yaw_rate: np.ndarray  # (episodes, steps) [rad/s]
    actuators_in_use: np.ndarray  # (episodes, steps) share of actuators with a non-zero command [-]
    effort: np.ndarray  # (episodes, steps) mean share of full command [-]
    variation: np.ndarray  # (episodes, steps) sum of the changes of these shares [-]
    goals: np.ndarray  # (episodes, steps) targets reached so far
    touching: np.ndarray  # (episodes, steps) 1 where the robot is at an obstacle
    outside: np.ndarray  # (episodes, steps) 1 where it is beyond the geofence
    control_dt: float  # [s]


COLUMNS = tuple(name for name in Trajectories.__annotations__ if name != "control_dt")


class TrajectoryLog:
    """Collects steps of one episode or of a batch; the figures are computed when asked for."""

    def __init__(self, robot: Robot, task: Task, control_dt: float) -> None:
        """Begin empty; `control_dt` in seconds."""
        self._robot, self._task, self._control_dt = robot, task, control_dt
        self._truths: list[PlanarState] = []
        self._goals: list[Goal] = []
        self._commands: list[np.ndarray] = []

    def add(self, truth: PlanarState, goal: Goal, command: np.ndarray) -> None:
        """Note one control step; none of the arguments may change later.

        Args:
            truth: True state after the step, shapes () or (episodes,).
            goal: Goal that the judge counts at that time, same leading shape.
            command: What was applied, shape (n,) or (episodes, n).
        """
        self._truths.append(truth)
        self._goals.append(goal)
        self._commands.append(np.asarray(command))

    def trajectories(self) -> Trajectories:
        """Everything noted so far."""
        truth, commands = stack_planar(self._truths, axis=-1), np.stack(self._commands, axis=-2)
        columns: dict[str, list[np.ndarray]] = {name: [] for name in _OF_EACH_STEP}
        for state, goal in zip(self._truths, self._goals, strict=True):
            for name, values in _step_columns(self._robot, self._task, state, goal).items():
                columns[name].append(values)
        share = np.abs(commands / self._robot.actuators.scale)
        change = np.abs(np.diff(commands / self._robot.actuators.scale, axis=-2, prepend=0.0))
        stacked = {name: np.stack(values, axis=-1) for name, values in columns.items()}
        stacked |= {
            "x": truth.x,
            "y": truth.y,
            "speed": truth.speed,
            "yaw_rate": truth.yaw_rate,
            "actuators_in_use": np.mean(share != 0.0, axis=-1),
            "effort": np.mean(share, axis=-1),
            "variation": np.sum(change, axis=-1),
        }
        return Trajectories(
            **{name: np.atleast_2d(stacked[name]) for name in COLUMNS}, control_dt=self._control_dt
        )


_OF_EACH_STEP = (
    "position_error", "heading_error", "velocity_error", "yaw_rate_error", "goals", "touching", "outside",
)  # fmt: skip


def _step_columns(robot: Robot, task: Task, state: PlanarState, goal: Goal) -> dict[str, np.ndarray]:
    errors, nothing = task.errors(state, goal), np.full(np.shape(state.x), np.nan)
    touching = task.collides(state, goal, robot)
    far = np.zeros(np.shape(state.x)) if errors.position is None else errors.position > robot.limits.geofence
    return {
        "position_error": nothing if errors.position is None else errors.position,
        "heading_error": nothing if errors.heading is None else errors.heading,
        "velocity_error": nothing if errors.velocity is None else errors.velocity,
        "yaw_rate_error": nothing if errors.yaw_rate is None else errors.yaw_rate,
        "goals": np.broadcast_to(goal.done, np.shape(state.x)),
        "touching": np.zeros(np.shape(state.x)) if touching is None else touching.astype(float),
        "outside": np.asarray(far, dtype=float),
    }


class Judge:
    """Counts targets by the task's own tolerance, whatever the controller takes for reached."""

    def __init__(self, task: Task, goal: Goal, control_dt: float) -> None:
        """Begin an episode, or a batch of them."""
        self._task, self._dt, self._steps = task, control_dt, 0
        self.goal = goal

    def see(self, truth: PlanarState) -> Goal:
        """The goal after one more control step, by the true state at its end."""
        self._steps += 1
        counted = getattr(self._task, "counted", None)
        if counted is not None:
            self.goal = counted(self.goal, truth, self._task.tolerance.position)
        else:
            time_s = np.asarray(self._steps * self._dt)
            self.goal = self._task.advance(self.goal, truth, time_s)
        return self.goal


def join(runs: list[Trajectories]) -> Trajectories:
    """One set of trajectories out of several of equal length and rate."""
    arrays = {name: np.concatenate([getattr(run, name) for run in runs]) for name in COLUMNS}
    return Trajectories(**arrays, control_dt=runs[0].control_dt)


def select(run: Trajectories, episodes: np.ndarray) -> Trajectories:
    """Some episodes of a set, in the order of their indices."""
    arrays = {name: getattr(run, name)[episodes] for name in COLUMNS}
    return Trajectories(**arrays, control_dt=run.control_dt)


def successes(run: Trajectories, task: Task) -> np.ndarray:
    """Which episodes succeeded.

    An episode succeeds if it stayed inside every tolerance of the task for the whole closing window, or, where the
    task counts targets, if it reached as many as are required; and if it touched nothing on its way.

    Args:
        run: What happened.
        task: Has the tolerances and the window.

    Returns:
        One truth value an episode, shape (episodes,).
    """
    clean = ~np.any(run.touching > 0.0, axis=1)
    required = getattr(task, "required", None)
    if required is not None:
        return np.asarray(clean & (run.goals[:, -1] >= required))
    window = max(1, round(task.tolerance.hold_s / run.control_dt))
    return np.asarray(clean & np.all(_inside(run, task)[:, -window:], axis=1))


def episode_metrics(run: Trajectories, task: Task) -> dict[str, np.ndarray]:
    """Every figure of every episode.

    Args:
        run: What happened.
        task: Has the tolerance that `time_to_target_s` is measured against.

    Returns:
        Arrays of shape (episodes,), by name. `time_to_target_s` is the time from which an episode stays inside
        the tolerance to its end, NaN where it never does; a figure that the task does not ask for is left out.
    """
    figures: dict[str, np.ndarray] = {}
    counts = getattr(task, "required", None) is not None
    if not counts and _asked(run.position_error):
        figures["final_position_error_m"] = run.position_error[:, -1]
    if not counts and _asked(run.heading_error):
        figures["final_heading_error_deg"] = np.abs(np.rad2deg(run.heading_error[:, -1]))
    if counts:
        figures["goals_reached"] = run.goals[:, -1]
    else:
        figures["time_to_target_s"] = _time_to_target(run, task)
        figures["inside_percent"] = 100.0 * np.mean(_inside(run, task), axis=1)
    if _asked(run.velocity_error):
        figures["velocity_error_m_s"] = np.mean(run.velocity_error, axis=1)
        figures["yaw_rate_error_deg_s"] = np.mean(np.abs(np.rad2deg(run.yaw_rate_error)), axis=1)
    if not counts and _asked(run.position_error):
        for centimetres in (5, 2, 1):
            inside = run.position_error < 0.01 * centimetres
            figures[f"PT{centimetres}_percent"] = 100.0 * np.mean(inside, axis=1)
    if not counts and _asked(run.heading_error):
        for limit in (5, 2, 1):
            inside = np.abs(np.rad2deg(run.heading_error)) < limit
            figures[f"OT{limit}_percent"] = 100.0 * np.mean(inside, axis=1)
    figures["ALV_m_s"] = np.mean(run.speed, axis=1)
    figures["AAV_rad_s"] = np.mean(np.abs(run.yaw_rate), axis=1)
    figures["AAS"] = np.mean(run.actuators_in_use, axis=1)
    figures["effort"] = np.mean(run.effort, axis=1)
    figures["control_variation"] = np.mean(run.variation, axis=1)
    figures["collided"] = np.any(run.touching > 0.0, axis=1).astype(float)
    figures["left_the_geofence"] = np.any(run.outside > 0.0, axis=1).astype(float)
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


def _asked(column: np.ndarray) -> bool:
    return not bool(np.isnan(column[:1, :1]).all())


def _inside(run: Trajectories, task: Task) -> np.ndarray:
    """Where an episode is inside every tolerance that the task has, shape (episodes, steps)."""
    tolerance = task.tolerance
    inside = np.ones(run.position_error.shape, dtype=bool)
    for error, limit in (
        (run.position_error, tolerance.position),
        (run.heading_error, np.deg2rad(tolerance.heading_deg)),
        (run.velocity_error, tolerance.velocity),
        (run.yaw_rate_error, np.deg2rad(tolerance.yaw_rate_deg)),
    ):
        if limit > 0.0:
            inside &= np.abs(error) <= limit
    return inside


def _time_to_target(run: Trajectories, task: Task) -> np.ndarray:
    stays = np.flip(np.logical_and.accumulate(np.flip(_inside(run, task), axis=1), axis=1), axis=1)
    first = np.argmax(stays, axis=1)
    return np.where(stays[:, -1], (first + 1) * run.control_dt, np.nan)
