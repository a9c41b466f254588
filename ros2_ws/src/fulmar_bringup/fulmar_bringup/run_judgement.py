"""A recorded run seen through its task: errors over time, success, gas.

The rules themselves live in `fulmar_core.metrics`; here a record is only brought into their shape.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_bringup.run_record import Actuation, Motion, RunRecord
from fulmar_core.errors import BagError
from fulmar_core.metrics import Trajectories, episode_metrics, successes
from fulmar_core.state import Pose, planar_pose
from fulmar_core.tasks import Task, load_task
from fulmar_core.tasks.planar import planar_error


@dataclass(frozen=True)
class Judgement:
    """What the task says about a run; times count from its first state.

    As in `fulmar_core.metrics`, a step is the state at its end: the first state itself is none.
    """

    task: Task
    goal: Pose  # the last one that was given
    time_s: np.ndarray  # (n,) ends of the steps: evenly spaced, simulated time [s]
    samples: np.ndarray  # (n,) index into `record.motion` of each time
    run: Trajectories  # one episode of n steps
    time_to_target_s: float | None  # from when on it stayed inside the tolerance; None: it did not
    duration_s: float  # [s]

    @property
    def success(self) -> bool:
        """Whether the whole closing window was recorded and spent inside the tolerance."""
        return self.long_enough and bool(successes(self.run, self.task)[0])

    @property
    def long_enough(self) -> bool:
        """Whether the run lasted for the whole closing window; half a step is left to rounding."""
        return bool(self.time_s[-1] > self.task.tolerance.hold_s - 0.5 * self.run.control_dt)

    @property
    def window_start_s(self) -> float:
        """Where the closing window begins, which success is judged in [s]."""
        return max(0.0, self.duration_s - self.task.tolerance.hold_s)


def judge(record: RunRecord) -> Judgement | None:
    """Judge a run by its task.

    Args:
        record: The run.

    Returns:
        The judgement; None if the record has fewer than two states.

    Raises:
        BagError: The record names no task or no goal.
        ConfigError: The task is not known here.
    """
    motion = record.motion
    if len(motion) < 2 or motion.stamp_s[-1] <= motion.stamp_s[0]:
        return None
    task = load_task(_text(record, "task"))
    time_s, samples = _even(motion)
    goals = _goals(record)
    given_s = np.array([log_s for log_s, _ in goals])
    current = np.clip(np.searchsorted(given_s, motion.log_s[samples], side="right") - 1, 0, None)
    goal = Pose(
        np.stack([pose.position_in_world for _, pose in goals])[current],
        np.stack([pose.quat_xyzw for _, pose in goals])[current],
    )
    states = motion.states[samples]
    error = planar_error(states, goal)
    run = Trajectories(
        position_error=error.position[None],
        heading_error=error.heading[None],
        speed=np.linalg.norm(states.velocity_in_world, axis=-1)[None],
        yaw_rate=states.angular_velocity_in_body[None, :, 2],
        actuators_in_use=_in_use(record.applied, motion.stamp_s[0] + time_s - time_s[0])[None],
        control_dt=float(time_s[0]),
    )
    reached_s = float(episode_metrics(run, task)["time_to_target_s"][0])
    return Judgement(
        task=task,
        goal=goals[-1][1],
        time_s=time_s,
        samples=samples,
        run=run,
        time_to_target_s=reached_s if np.isfinite(reached_s) else None,
        duration_s=float(motion.stamp_s[-1] - motion.stamp_s[0]),
    )


def _text(record: RunRecord, key: str) -> str:
    value = record.info.get(key)
    if not isinstance(value, str):
        raise BagError(f"{record.path}: the run information names no {key}, found {value!r}.")
    return value


def _goals(record: RunRecord) -> list[tuple[float, Pose]]:
    """Goals with the time they came [s]; what was asked for if the bag has none."""
    if record.goals:
        return [(goal.log_s, goal.pose) for goal in record.goals]
    asked: Any = record.info.get("goal")
    try:
        x, y, heading_deg = (float(value) for value in asked)
    except (TypeError, ValueError):
        raise BagError(
            f"{record.path}: holds no goal, and its run information has {asked!r} for one."
        ) from None
    return [(-np.inf, planar_pose(x, y, np.deg2rad(heading_deg)))]


def _even(motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    """Ends of evenly long steps, and the newest sample at each; a lost sample leaves the one before."""
    since = motion.stamp_s - motion.stamp_s[0]
    steps = np.diff(since)
    dt = float(np.median(steps[steps > 0.0]))
    time_s = dt * np.arange(1, round(since[-1] / dt) + 1)
    samples = np.searchsorted(since, time_s + 1e-3 * dt, side="right") - 1
    return time_s, samples


def _in_use(applied: Actuation, stamp_s: np.ndarray) -> np.ndarray:
    """Share of actuators in use from some times on, shape of `stamp_s`."""
    if not len(applied):
        return np.full(len(stamp_s), np.nan)
    newest = np.clip(np.searchsorted(applied.stamp_s, stamp_s + 1e-6, side="right") - 1, 0, None)
    return np.mean(applied.effort != 0.0, axis=1)[newest]
