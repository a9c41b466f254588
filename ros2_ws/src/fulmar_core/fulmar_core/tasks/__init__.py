"""Tasks: what a robot shall reach, what its controller sees, how it is judged.

The explicit table of tasks. A new task is one file here, one line below and one YAML.
"""

from __future__ import annotations

from typing import cast

from fulmar_core.config import load_config
from fulmar_core.errors import ConfigError
from fulmar_core.paths import config_path
from fulmar_core.plausibility import check_plausible
from fulmar_core.plausible_ranges import TASK
from fulmar_core.robot import Robot
from fulmar_core.tasks.go_through_poses import GoThroughPoses
from fulmar_core.tasks.go_through_positions import GoThroughPositions
from fulmar_core.tasks.go_to_pose import GoToPose
from fulmar_core.tasks.go_to_position import GoToPosition
from fulmar_core.tasks.go_to_position_with_obstacles import GoToPositionWithObstacles
from fulmar_core.tasks.passing import PassingTask
from fulmar_core.tasks.push_block import PushBlock
from fulmar_core.tasks.race_gates import RaceGates
from fulmar_core.tasks.race_waypoints import RaceWaypoints
from fulmar_core.tasks.race_wayposes import RaceWayposes
from fulmar_core.tasks.track_velocities import TrackVelocities

Task = (
    GoToPose
    | GoToPosition
    | GoToPositionWithObstacles
    | GoThroughPositions
    | GoThroughPoses
    | TrackVelocities
    | RaceWaypoints
    | RaceWayposes
    | RaceGates
    | PushBlock
)


def load_task(name: str) -> Task:
    """Read `configs/tasks/<name>.yaml`.

    Args:
        name: A name that `fulmar list tasks` shows.

    Returns:
        The task.

    Raises:
        ConfigError: Unknown name, or a mistake in the file.
    """
    path = config_path("tasks", name)
    task = cast(Task, load_config(Task, path))  # type: ignore[arg-type]
    if task.name != name:
        raise ConfigError(
            f"{path}: 'name' is '{task.name}', the file's own name is '{name}'. Make them equal."
        )
    check_plausible(task, TASK, path)
    return task


def fitted(task: Task, robot: Robot) -> Task:
    """A task as a robot does it: how near it has to come depends on how well it knows its place."""
    return task.fitted(robot) if isinstance(task, PassingTask) else task


def sees_obstacles(task: Task) -> bool:
    """Whether a controller of this task must be told what stands about."""
    return isinstance(task, GoToPositionWithObstacles)
