"""Path following as a task: velocities along a path, as the goal node publishes them, for many robots at once."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.planar import PlanarState, at_rest, to_body
from fulmar_core.states.rotation import Array
from fulmar_core.tasks import Task, load_task
from fulmar_core.tasks.goal import Goal, no_obstacles
from fulmar_core.tasks.goal_files import FollowedPath, load_goals
from fulmar_core.tasks.references.look_ahead import LookAhead
from fulmar_core.tasks.track_velocities import TrackVelocities


@dataclass(frozen=True, kw_only=True)
class FollowPath(TrackVelocities):
    """Track the velocity that leads along a closed path without end, by `LookAhead`, without turning.

    `Goal.done` counts the points of the path that have been passed. In NumPy only.
    """

    path: LookAhead
    lead_s: float = 0.0  # see `FollowedPath`

    @property
    def evaluated(self) -> FollowPath:
        """The task with the errors of evaluations: against the velocity that counts where the robot is."""
        return dataclasses.replace(self, lead_s=0.0)

    def __post_init__(self) -> None:
        if not self.path.closed or self.path.loops:
            raise ValueError("a path for an evaluation must be closed and have no last round (loops: 0).")

    def draw(self, draws: Draws, robot: Robot, *, training: bool) -> tuple[PlanarState, Goal]:
        """Draw a start at rest, anywhere on the path and with any heading."""
        count = len(self.path.points)
        index = np.floor(draws.uniform(0.0, 1.0) * count) % count
        yaw = draws.uniform(-math.pi, math.pi)
        places = self.path.points[index.astype(int)]
        state = at_rest(places[:, 0], places[:, 1], yaw)
        targets = np.zeros((len(yaw), 1, 3))
        goal = Goal(targets, index, no_obstacles(draws.worlds))
        return state, self.advance(goal, state, np.zeros_like(yaw))

    def advance(self, goal: Goal, state: PlanarState, time_s: Array) -> Goal:
        """The velocity towards the aim, from where the robot is; arguments and steps as in `LookAhead.aim`."""
        path, count = self.path, len(self.path.points)
        ahead = max(1, round(path.look_ahead / path.spacing))
        here = np.stack((state.x + self.lead_s * state.vx, state.y + self.lead_s * state.vy), axis=-1)
        passed = np.asarray(goal.done).astype(int)
        window = passed[..., None] + np.arange(min(2 * ahead, count - 1) + 1)
        offsets = path.points[window % count] - here[..., None, :]
        passed = passed + np.argmin(np.sum(offsets * offsets, axis=-1), axis=-1)
        way = path.points[(passed + ahead) % count] - here
        speed = path.speed / np.maximum(np.linalg.norm(way, axis=-1), 1e-9)
        u, v = to_body(np.asarray(state.yaw), way[..., 0] * speed, way[..., 1] * speed)
        target = np.stack((u, v, np.zeros_like(u)), axis=-1)[..., None, :]
        dtype = goal.targets.dtype
        return dataclasses.replace(goal, targets=np.asarray(target, dtype=dtype), done=passed.astype(dtype))

    def off_path(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Distance to the nearest point of the whole path, shapes (n,) [m]."""
        points = self.path.points
        return np.array(
            [math.sqrt(np.min(np.sum((points - place) ** 2, axis=1))) for place in np.stack((x, y), -1)]
        )


def path_task(task: TrackVelocities, file: FollowedPath) -> FollowPath:
    """The task of following a path, with the tolerances and the observation of tracking velocities."""
    values = {field.name: getattr(task, field.name) for field in dataclasses.fields(task)}
    return FollowPath(**values, path=file.planner(), lead_s=file.lead_s)


def evaluated_task(
    name: str, *, thing: str = "", along: str = "", episode_s: float = 0.0, goals: str = ""
) -> Task:
    """The task that evaluates episodes.

    Args:
        name: As in `load_task`.
        thing: Same.
        along: As in `Task.along`; empty: as the task has it.
        episode_s: Length of an episode; 0: the task's own [s].
        goals: Goal file whose path is followed; empty: none.

    Raises:
        ConfigError: Unknown name, a goal file that is no endless path, or a task that tracks no velocities.
    """
    task = load_task(name, thing)
    task = task.along(along) if along else task
    if episode_s:
        task = cast(Task, dataclasses.replace(cast(Any, task), episode_s=episode_s))  # all are dataclasses
    if not goals:
        return task
    file = load_goals(goals)
    if not isinstance(file, FollowedPath) or not isinstance(task, TrackVelocities):
        raise ConfigError(f"episodes follow paths of velocities alone; '{goals}' is none.")
    try:
        return path_task(task, file)
    except ValueError as error:
        raise ConfigError(f"goals '{goals}': {error}") from error
