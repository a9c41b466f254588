"""Geofence and area: how far a robot may be from its goal, and where robot and goals may be."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from fulmar_core.config.errors import ConfigError

if TYPE_CHECKING:  # the command line checks areas without loading NumPy
    from fulmar_core.robots.robot import Robot
    from fulmar_core.tasks import Task

NO_AREA = (0.0, 0.0, 0.0, 0.0)  # an area without extent stands for none
FARTHEST_M = (
    1000.0  # of a goal from the origin, unless a robot's geofence reaches farther: as in `farthest_goal`
)
OUT_OF_BOUNDS = "out of bounds: "  # how the reason begins by which a controller refuses such a goal


def check_area(area: Sequence[float]) -> None:
    """Reject an invalid area: x_min, x_max, y_min, y_max, in space also z_min, z_max [m].

    Raises:
        ValueError: It has no extent, or is not finite.
    """
    good = len(area) in (4, 6) and all(math.isfinite(side) for side in area)
    if not good or not all(low < high for low, high in _spans(area)):
        raise ValueError(
            f"area = {list(area)} must be x_min, x_max, y_min, y_max with x_min < x_max, y_min < y_max; in space with "
            "z_min < z_max behind them."
        )


def check_area_of(robot: Robot, area: Sequence[float]) -> None:
    """Reject an area that has not two sides for each coordinate of a robot.

    Raises:
        ConfigError: A rectangle in space, or a box in the plane.
    """
    form = robot.state_type
    if tuple(area) != NO_AREA and len(area) != 2 * form.AXES:
        sides = ",".join(f"{axis}_min,{axis}_max" for axis in "xyz"[: form.AXES])
        raise ConfigError(
            f"area = {list(area)}: '{robot.name}' moves in {form.WORLD}, where an area has {2 * form.AXES} "
            f"sides: {sides}."
        )


def outside(place: Sequence[float], area: Sequence[float], *, guarded: bool = False) -> str:
    """Message that a place lies outside an area; empty if it does not.

    Args:
        place: x, y or x, y, z [m].
        area: Sides in the form of `check_area`.
        guarded: Whether a guard brings the robot back.
    """
    if is_inside(place, area):
        return ""
    then = (
        "The guard brings it back; then give a goal."
        if guarded
        else "Bring it back by hand, then give a goal."
    )
    return f"the robot was at {_words(place, '.2f')}, outside its area of {_sides(area)}. {then}"


def is_inside(place: Sequence[float], area: Sequence[float]) -> bool:
    """Whether a place lies in an area, as far as that has sides [m]."""
    if tuple(area) == NO_AREA:
        return True
    return all(low <= value <= high for value, (low, high) in zip(place, _spans(area), strict=False))


def farthest_goal(robot: Robot) -> float:
    """How far from the origin a goal of a robot may lie [m]; one beyond is a mistake of units or of frames."""
    return max(FARTHEST_M, robot.limits.geofence)


def unreachable(
    what: str, places: Iterable[Sequence[float]], area: Sequence[float], farthest_m: float = FARTHEST_M
) -> str:
    """Why a robot must not go to one of some places; empty if it may go to all of them.

    Args:
        what: What the places are, such as `goal`.
        places: Each x [m], y [m] and whatever follows in the plane: at most three numbers; x, y, z [m] and the attitude
            in space: more.
        area: Area of the robot.
        farthest_m: From the origin, as in `farthest_goal`.
    """
    for numbers in places:
        place = numbers[: 3 if len(numbers) > 3 else 2]
        if not is_inside(place, area):
            return f"{what} {_words(place, 'g')} lies outside the area of {_sides(area)}."
        away = math.hypot(*place)
        if not away <= farthest_m:  # also where it is not a number
            return f"{what} {_words(place, 'g')} lies {away:,.0f} m from the origin, farther than {farthest_m:,.0f} m."
    return ""


def check_places(
    what: str,
    places: Iterable[Sequence[float]],
    area: Sequence[float] = NO_AREA,
    farthest_m: float = FARTHEST_M,
) -> None:
    """Reject places that a robot must not go to; arguments as in `unreachable`.

    Raises:
        ConfigError: For the first of them.
    """
    problem = unreachable(what, places, area, farthest_m)
    if problem:
        raise ConfigError(f"{problem} Give another place, in metres.")


def _sides(area: Sequence[float]) -> str:
    return ", ".join(
        f"{axis} {low:g} to {high:g} m" for axis, (low, high) in zip("xyz", _spans(area), strict=False)
    )


def _spans(area: Sequence[float]) -> list[tuple[float, float]]:
    return list(zip(area[::2], area[1::2], strict=True))


def _words(place: Sequence[float], form: str) -> str:
    return ", ".join(f"{axis} = {value:{form}} m" for axis, value in zip("xyz", place, strict=False))


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
