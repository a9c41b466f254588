"""Geofence and area: how far a robot may be from its goal, and where it may be."""

from __future__ import annotations

import math
from collections.abc import Sequence

from fulmar_core.errors import ConfigError
from fulmar_core.robot import Robot
from fulmar_core.tasks import Task

NO_AREA = (0.0, 0.0, 0.0, 0.0)  # an area without extent stands for none


def check_area(area: Sequence[float]) -> None:
    """Reject an invalid area: x_min, x_max, y_min, y_max [m].

    Raises:
        ValueError: It has no extent, or is not finite.
    """
    good = len(area) == 4 and all(math.isfinite(side) for side in area)
    if not good or not (area[0] < area[1] and area[2] < area[3]):
        raise ValueError(
            f"area = {list(area)} must be x_min, x_max, y_min, y_max with x_min < x_max, y_min < y_max."
        )


def outside(x: float, y: float, area: Sequence[float]) -> str:
    """Message that a place lies outside an area; empty if it does not [m]."""
    if tuple(area) == NO_AREA or (area[0] <= x <= area[1] and area[2] <= y <= area[3]):
        return ""
    return (
        f"the robot was at x = {x:.2f} m, y = {y:.2f} m, outside its area of x {area[0]:g} to {area[1]:g} m, "
        f"y {area[2]:g} to {area[3]:g} m. Bring it back by hand, then give a goal."
    )


def check_starts(robot: Robot, task: Task, *, training: bool = False) -> None:
    """Reject a robot whose geofence is smaller than the distances that a task draws its starts from.

    Raises:
        ConfigError: Episodes, those for learning if `training`, would start beyond the geofence.
    """
    key, farthest = task.farthest_start(training=training)
    if farthest > robot.limits.geofence:
        raise ConfigError(
            f"'limits.geofence' = {robot.limits.geofence:g} m of robot '{robot.name}' is smaller than the starts of "
            f"task '{task.name}', up to {farthest:g} m from the goal ('{key}'). Give the robot a geofence of at least "
            f"{farthest:g} m, give the task nearer starts, or run it with --start and --goal."
        )
