"""Values of options that are written as text: names, areas, goals and poses."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.safety.geofence import check_area

if TYPE_CHECKING:
    from fulmar_bringup.system import Guards

GOAL = "--goal"
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
        ConfigError: Unknown fallback or guard.
    """
    from fulmar_bringup.system import Guards
    from fulmar_core.loop.controller_settings import ENVELOPE
    from policy_server.controllers import FALLBACKS

    if given["fallback"] not in (None, *FALLBACKS):
        raise UnknownNameError("fallback", given["fallback"], FALLBACKS)
    if given.get("guard") not in (None, ENVELOPE):
        raise UnknownNameError("guard", given["guard"], (ENVELOPE,))
    return Guards(**{name: value for name, value in given.items() if value is not None})


def read_goal(text: str | None, option: str = GOAL, robot: str = "") -> tuple[float, ...] | None:
    """Read a place, an attitude or a pose: `x,y` or `x,y,deg`, in space as `Kind.goal_forms` [m, deg].

    Args:
        text: What was given.
        option: What gave it.
        robot: Whose goal it is, where that is known: it then has to have as many numbers as that takes.

    Raises:
        ConfigError: If it is not two, three or six finite numbers, or not what this robot takes.
    """
    return _read_place(text, option, robot, (2, 3, 6))


def read_pose(text: str | None, option: str, robot: str = "") -> tuple[float, ...] | None:
    """Read a pose: `x,y,deg`, in space `x,y,z`, upright, or six numbers; else as in `read_goal`."""
    return _read_place(text, option, robot, (3, 6))


def read_numbers(text: str | None, option: str, wanted: str = "x,y,deg [m, deg]") -> tuple[float, ...] | None:
    """Read numbers with commas between them; raises ConfigError for the first that is none, or not finite."""
    if text is None:
        return None
    for part in text.split(","):
        if not _is_finite(part):
            raise ConfigError(
                f"{option} = '{text}': '{part.strip()}' is no finite number. Give {wanted}, with commas and no units."
            )
    return tuple(float(part) for part in text.split(","))


def _read_place(
    text: str | None, option: str, robot: str, counts: tuple[int, ...]
) -> tuple[float, ...] | None:
    """Read a place, an attitude or a pose; without a robot any of so many numbers."""
    if text is None:
        return None
    if not robot:
        numbers = read_numbers(text, option) or ()
        if len(numbers) not in counts:
            wanted = "x,y,deg or x,y" if 2 in counts else "x,y,deg"
            raise ConfigError(
                f"{option} = '{text}' must be {wanted}, in space x,y,z,roll,pitch,yaw or three of them [m, deg]."
            )
        return numbers
    from fulmar_core.robots.robot_file import load_robot
    from fulmar_core.tasks.goal_numbers import forms_of, whole_pose

    the_robot = load_robot(robot)
    forms = forms_of(the_robot, option)
    numbers = read_numbers(text, option, f"{' or '.join(map(','.join, forms))} [m, deg]") or ()
    whole_pose(numbers, the_robot, option)
    return numbers


def _read(
    text: str | None,
    option: str,
    wanted: str,
    fits: Callable[[tuple[float, ...]], bool],
) -> Any:
    if text is None:
        return None
    try:
        values = tuple(float(part) for part in text.split(","))
        if all(map(math.isfinite, values)) and fits(values):
            return values
    except ValueError:  # of a part, or of `fits`
        pass
    raise ConfigError(f"{option} = '{text}' must be {wanted}")


def _is_finite(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False
