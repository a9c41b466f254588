"""Values of options that are written as text: names, areas, goals and poses."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.safety.geofence import check_area

if TYPE_CHECKING:
    from fulmar_bringup.system import Guards

Area = tuple[float, ...]  # x_min, x_max, y_min, y_max, in space also z_min, z_max [m]


def read_names(
    text: str, family: str, known: Sequence[str], *, as_given: bool = False, every: str = "all"
) -> tuple[str, ...]:
    """Read names with commas between them, in the order of those known or `as_given`; `every` stands for all of them.

    Raises:
        UnknownNameError: For the first that is not known.
        ConfigError: There is none.
    """
    names = list(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    for name in names:
        if name not in (*known, every):
            raise UnknownNameError(family, name, known)
    if not names:
        raise ConfigError(f"'{text}' names no {family}; known: {', '.join(known)}, or {every}.")
    if as_given and every not in names:
        return tuple(names)
    return tuple(name for name in known if name in names or every in names)


def read_area(text: str | None) -> Area | None:
    """Read `x_min,x_max,y_min,y_max` of --area, in space with `z_min,z_max` behind them [m].

    Raises:
        ConfigError: If it is not such an area.
    """
    wanted = (
        "x_min,x_max,y_min,y_max in m with x_min < x_max and y_min < y_max, such as --area=-2,2,-1,1. "
        "In space z_min,z_max follow, with z_min < z_max."
    )

    def is_area(values: tuple[float, ...]) -> bool:
        check_area(values)
        return True

    return _read(text, "--area", wanted, is_area)


def read_guards(**given: Any) -> Guards:
    """Guards as options give them; None: not given.

    Raises:
        ConfigError: Unknown fallback.
    """
    from fulmar_bringup.system import Guards
    from policy_server.controllers import FALLBACKS

    if given["fallback"] not in (None, *FALLBACKS):
        raise UnknownNameError("fallback", given["fallback"], FALLBACKS)
    return Guards(**{name: value for name, value in given.items() if value is not None})


def read_goal(text: str | None, option: str = "--goal", robot: str = "") -> tuple[float, ...] | None:
    """Read a place or a pose: `x,y` or `x,y,deg`, in space `x,y,z` or `x,y,z,roll,pitch,yaw` [m, deg].

    Args:
        text: What was given.
        option: What gave it.
        robot: Whose goal it is, where that is known: the message then says what this robot needs.

    Raises:
        ConfigError: If it is not two, three or six finite numbers.
    """
    wanted = (
        "two or three finite numbers: x [m], y [m] and, for a pose, heading [deg]. "
        f"Example: {option} 1,-0.5 or {option} 1,-0.5,90. In space x,y,z or x,y,z,roll,pitch,yaw [m, deg]."
    )
    return _read(text, option, wanted, lambda values: len(values) in (2, 3, 6), robot)


def read_pose(text: str | None, option: str, robot: str = "") -> tuple[float, ...] | None:
    """Read a pose: `x,y,deg`, in space `x,y,z`, upright, or `x,y,z,roll,pitch,yaw` [m, deg].

    Args:
        text: What was given.
        option: What gave it.
        robot: As in `read_goal`.

    Raises:
        ConfigError: If it is not three or six finite numbers.
    """
    wanted = (
        f"three finite numbers: x [m], y [m], heading [deg]. Example: {option} 1,-0.5,90. "
        "In space x,y,z,roll,pitch,yaw [m, deg]."
    )
    return _read(text, option, wanted, lambda values: len(values) in (3, 6), robot)


def _read(
    text: str | None,
    option: str,
    wanted: str,
    fits: Callable[[tuple[float, ...]], bool],
    robot: str = "",
) -> Any:
    if text is None:
        return None
    try:
        values = tuple(float(part) for part in text.split(","))
        if all(map(math.isfinite, values)) and fits(values):
            return values
    except ValueError:  # of a part, or of `fits`
        pass
    if robot:
        _refuse_in_space(text, option, robot)
    raise ConfigError(f"{option} = '{text}' must be {wanted}")


def _refuse_in_space(text: str, option: str, robot: str) -> None:
    """Say what a robot in space needs; nothing for one in the plane.

    Raises:
        ConfigError: The robot moves in space, or there is none of this name.
    """
    from fulmar_core.robots.robot_file import load_robot
    from fulmar_core.states.planar import PlanarState

    form = load_robot(robot).state_type
    if form is PlanarState:
        return
    parts = text.split(",")
    place, pose = form.NUMBERS[: form.AXES], form.NUMBERS
    needed = f"{len(place)} ({','.join(place)}) or {len(pose)} ({','.join(pose)})"
    if all(map(_is_finite, parts)):
        raise ConfigError(f"{option} = '{text}' has {len(parts)} numbers; {needed} are needed [m, deg].")
    raise ConfigError(f"{option} = '{text}' must be {needed} finite numbers [m, deg].")


def _is_finite(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False
