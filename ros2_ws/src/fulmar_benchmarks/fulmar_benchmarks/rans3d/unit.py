"""One controller at one task in space: its episodes, and what is gathered beside the figures of every benchmark."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

from fulmar_benchmarks.rans3d.targets import NOMINAL, RANS_ATTITUDE_RAD, RANS_POSITION_M, RANS_STEPS
from fulmar_benchmarks.unit import Extra, TrialCell
from fulmar_core.simulation.episode import Episode
from fulmar_core.simulation.metrics import Trajectories
from fulmar_core.states.attitude import angle_between
from fulmar_core.states.spatial import SpatialState, quat_of
from fulmar_core.tasks import Task
from fulmar_core.worlds.spatial_holdability import can_hold_in_space
from fulmar_core.worlds.spatial_world import SpatialWorld
from fulmar_evaluation.evaluation import Trial

HELD = "can_hold"  # name of the kept array


@dataclass(frozen=True)
class SpaceTrial(Trial):
    """A trial whose episodes may start nearer to the goal than the task's own."""

    farthest_m: float = 0.0  # 0: as the task says

    @property
    def task(self) -> Task:
        """The task, with the start and the length of its episodes."""
        return started_within(super().task, self.farthest_m) if self.farthest_m else super().task


def started_within(task: Task, farthest: float) -> Task:
    """The task with no start farther from the first target than so many metres, if it has one at all."""
    its = cast(Any, task)  # every task is a dataclass
    if hasattr(task, "start"):
        low, high = its.start.distance
        nearer = replace(its.start, distance=(min(low, farthest), min(high, farthest)))
        return cast(Task, replace(its, start=nearer))
    if hasattr(task, "start_distance"):
        low, high = its.start_distance
        return cast(Task, replace(its, start_distance=(min(low, farthest), min(high, farthest))))
    return task


@dataclass(frozen=True, kw_only=True)
class SpaceCell(TrialCell):
    """A trial of one controller in one scenario."""

    def parts(self) -> dict[str, Any]:
        """The start decides, too."""
        return {**super().parts(), "farthest_m": cast(SpaceTrial, self.trial).farthest_m}

    def extra(self) -> Extra:
        """What RANS' own tolerance says, and which episodes can be held."""
        return SpaceExtra(self.trial)

    def map_place(self, drawn: Episode) -> np.ndarray:
        """Distance [m] and angle [deg] from the first target at the start, or wanted speed and turn rate."""
        start, first = cast(SpatialState, drawn.start), np.asarray(drawn.goal.targets)[:, 0]
        if self.trial.task.goal_topic == "goal_velocity":
            speed, rate = (np.linalg.norm(part, axis=-1) for part in (first[:, :3], first[:, 3:]))
            return np.stack((speed, np.rad2deg(rate)), axis=-1)
        angle = np.rad2deg(angle_between(start.quat, quat_of(first)))
        return np.stack((start.distance_to(first), angle), axis=-1)


class SpaceExtra(Extra):
    """Episodes within RANS' tolerance for long enough; where something is disturbed, also those that can be held."""

    def __init__(self, trial: Trial) -> None:
        """Begin empty."""
        self._trial = trial
        self._within: list[np.ndarray] = []

    def add(self, run: Trajectories) -> None:
        """Take note of some more episodes."""
        if np.isfinite(run.position_error[0, 0]) and self._trial.task.required is None:
            inside = run.position_error < RANS_POSITION_M
            if run.attitude_error is not None and np.isfinite(run.attitude_error[0, 0]):
                inside = inside & (run.attitude_error < RANS_ATTITUDE_RAD)
            self._within.append(longest_run(inside) >= RANS_STEPS)

    def figures(self) -> dict[str, np.ndarray]:
        """Whether RANS' tolerance was held, of tasks with a place to hold, shape (episodes,)."""
        return {"held_rans_tolerance": np.concatenate(self._within).astype(float)} if self._within else {}

    def arrays(self) -> dict[str, np.ndarray]:
        """Which episodes the linear programme can hold, shape (episodes,)."""
        trial = self._trial
        if trial.plan.scenario == NOMINAL:
            return {}
        drawn = trial.drawn(np.arange(trial.episodes))
        to_pose = trial.task.required is None and trial.task.goal_topic == "goal_pose"
        quats = np.asarray(drawn.goal.targets)[:, 0, 3:] if to_pose else None
        return {HELD: can_hold_in_space(trial.robot, cast(SpatialWorld, drawn.world), quats)}


def longest_run(truths: np.ndarray) -> np.ndarray:
    """The most steps in a row at which something holds, shape (episodes, steps) to (episodes,)."""
    most, now = (np.zeros(len(truths), dtype=int) for _ in range(2))
    for column in truths.T:
        now = np.where(column, now + 1, 0)
        most = np.maximum(most, now)
    return most
