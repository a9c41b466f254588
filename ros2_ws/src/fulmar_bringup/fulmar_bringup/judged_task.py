"""The task that a plan is judged by: of its name, with its own length, along its path."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

from fulmar_bringup.node_table import RunPlan
from fulmar_core.errors import ConfigError
from fulmar_core.goal_files import FollowedPath, load_goals
from fulmar_core.path_task import path_task
from fulmar_core.tasks import Task, load_task
from fulmar_core.tasks.track_velocities import TrackVelocities


def task_of(plan: RunPlan) -> Task:
    """The task, with the length of its episodes; with a goal file, following its path.

    Raises:
        ConfigError: The goal file is no path for ever, or the task tracks no velocities.
    """
    task = load_task(plan.task)
    if plan.duration_s:
        task = cast(Task, replace(cast(Any, task), episode_s=plan.duration_s))  # every task is a dataclass
    if not plan.goals:
        return task
    file = load_goals(plan.goals)
    if not isinstance(file, FollowedPath) or not isinstance(task, TrackVelocities):
        raise ConfigError(f"episodes are judged along paths of velocities alone; '{plan.goals}' is none.")
    try:
        return path_task(task, file)
    except ValueError as error:
        raise ConfigError(f"goals '{plan.goals}': {error}") from error
