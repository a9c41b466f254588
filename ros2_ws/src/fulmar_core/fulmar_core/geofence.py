"""What the geofence limits: how far a robot may be from its goal."""

from __future__ import annotations

from fulmar_core.errors import ConfigError
from fulmar_core.robot import Robot
from fulmar_core.tasks import Task
from fulmar_core.tasks.push_block import PushBlock


def check_starts(robot: Robot, task: Task, *, training: bool = False) -> None:
    """Refuse a robot whose geofence is smaller than the distances that a task draws its starts from.

    Args:
        robot: Has the geofence.
        task: Draws the starts.
        training: Of the starts for learning, not those for evaluation.

    Raises:
        ConfigError: Episodes would start beyond the geofence.
    """
    key, farthest = _farthest_start(task, training)
    if farthest > robot.limits.geofence:
        raise ConfigError(
            f"'limits.geofence' = {robot.limits.geofence:g} m of robot '{robot.name}' is smaller than the starts of "
            f"task '{task.name}', up to {farthest:g} m from the goal ('{key}'). Give the robot a geofence of at least "
            f"{farthest:g} m, give the task nearer starts, or run it with --start and --goal."
        )


def _farthest_start(task: Task, training: bool) -> tuple[str, float]:
    """Key and largest distance from the first target; 0 where targets are no places [m]."""
    if isinstance(task, PushBlock):
        name = "training_block_distance" if training else "block_distance"
        return f"{name}' + 'start_distance", getattr(task, name)[1] + task.start_distance[1]
    start = getattr(task, "start", None)
    if start is not None:
        name = "training_distance" if training else "distance"
        return f"start.{name}", getattr(start, name)[1]
    return "start_distance", getattr(task, "start_distance", (0.0, 0.0))[1]
