"""What the geofence limits: how far a robot may be from its goal."""

from __future__ import annotations

from fulmar_core.errors import ConfigError
from fulmar_core.robot import Robot
from fulmar_core.tasks import Task


def check_starts(robot: Robot, task: Task, *, training: bool = False) -> None:
    """Refuse a robot whose geofence is smaller than the distances that a task draws its starts from.

    Args:
        robot: Has the geofence.
        task: Draws the starts.
        training: Of the starts for learning, not those for evaluation.

    Raises:
        ConfigError: Episodes would start beyond the geofence.
    """
    key, farthest = task.farthest_start(training=training)
    if farthest > robot.limits.geofence:
        raise ConfigError(
            f"'limits.geofence' = {robot.limits.geofence:g} m of robot '{robot.name}' is smaller than the starts of "
            f"task '{task.name}', up to {farthest:g} m from the goal ('{key}'). Give the robot a geofence of at least "
            f"{farthest:g} m, give the task nearer starts, or run it with --start and --goal."
        )
