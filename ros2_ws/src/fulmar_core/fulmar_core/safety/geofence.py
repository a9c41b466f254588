"""Geofence and area: how far a robot may be from its goal, and where robot and goals may be."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from fulmar_core.errors import ConfigError

if TYPE_CHECKING:  # the command line checks areas without loading NumPy
    from fulmar_core.robot import Robot
    from fulmar_core.tasks import Task

NO_AREA = (0.0, 0.0, 0.0, 0.0)  # an area without extent stands for none
FARTHEST_M = 1000.0  # of a goal from the origin: a goal beyond it is a mistake of units or of frames
OUT_OF_BOUNDS = "out of bounds: "  # how the reason begins by which a controller refuses such a goal


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
    if is_inside(x, y, area):
        return ""
    return (
        f"the robot was at x = {x:.2f} m, y = {y:.2f} m, outside its area of {_sides(area)}. "
        "Bring it back by hand, then give a goal."
    )


def is_inside(x: float, y: float, area: Sequence[float]) -> bool:
    """Whether a place [m] lies in an area."""
    return tuple(area) == NO_AREA or (area[0] <= x <= area[1] and area[2] <= y <= area[3])


def unreachable(what: str, places: Iterable[Sequence[float]], area: Sequence[float]) -> str:
    """Why a robot must not go to one of some places; empty if it may go to all of them.

    Args:
        what: What the places are, such as `goal`.
        places: Each x [m], y [m] and whatever follows.
        area: Area of the robot.
    """
    for x, y, *_ in places:
        if not is_inside(x, y, area):
            return f"{what} x = {x:g} m, y = {y:g} m lies outside the area of {_sides(area)}."
        if not math.hypot(x, y) <= FARTHEST_M:  # also where it is not a number
            return (
                f"{what} x = {x:g} m, y = {y:g} m lies {math.hypot(x, y):,.0f} m from the origin, "
                f"farther than {FARTHEST_M:,.0f} m."
            )
    return ""


def check_places(what: str, places: Iterable[Sequence[float]], area: Sequence[float] = NO_AREA) -> None:
    """Reject places that a robot must not go to; arguments as of `unreachable`.

    Raises:
        ConfigError: For the first of them.
    """
    problem = unreachable(what, places, area)
    if problem:
        raise ConfigError(f"{problem} Give another place, in metres.")


def _sides(area: Sequence[float]) -> str:
    return f"x {area[0]:g} to {area[1]:g} m, y {area[2]:g} to {area[3]:g} m"


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
