"""The file of a layout: its name, its text, how to open it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from fulmar_bringup.layouts.fleet_layouts import fleet_foxglove, fleet_rviz, robots_of
from fulmar_bringup.layouts.foxglove_layout import foxglove_layout
from fulmar_bringup.layouts.rviz_layout import rviz_layout
from fulmar_bringup.layouts.viewed_robot import ViewedRobot, viewed_robot
from fulmar_core.config.atomic_write import write_whole
from fulmar_core.config.errors import ConfigError, UnknownNameError


@dataclass(frozen=True)
class Program:
    """A viewer."""

    suffix: str  # of its files
    text_of: Callable[[ViewedRobot], str]
    text_of_fleet: Callable[[Sequence[ViewedRobot]], str]
    opening: str  # how its file is opened; `{file}` stands for it


PROGRAMS = {
    "rviz": Program(".rviz", rviz_layout, fleet_rviz, "rviz2 -d {file}"),
    "foxglove": Program(
        ".json", foxglove_layout, fleet_foxglove, 'Foxglove: menu "Layouts", "Import from file", {file}'
    ),
}


def layout_text(robot: str, program: str, name: str | None = None, *, fleet: bool = False) -> str:
    """The text of a layout; arguments as in `write_layout`.

    Raises:
        ConfigError: Unknown robot, fleet, program or name.
    """
    if program not in PROGRAMS:
        raise UnknownNameError("program", program, PROGRAMS)
    if fleet:
        return PROGRAMS[program].text_of_fleet(robots_of(robot))
    return PROGRAMS[program].text_of(viewed_robot(robot, name))


def write_layout(
    robot: str,
    program: str,
    name: str | None = None,
    *,
    file: Path | None = None,
    force: bool = False,
    fleet: bool = False,
) -> tuple[Path, str]:
    """Write a layout.

    Args:
        robot: A robot's name, or its file; or the name of a fleet.
        program: One of `PROGRAMS`.
        name: What the robot is called; as its type by default.
        file: Where to; `<name>.rviz` or `<name>.json` in the current folder by default.
        force: Replace a file.
        fleet: Whether a fleet is meant, all of whose robots the layout has.

    Returns:
        The file, and how it is opened.

    Raises:
        ConfigError: Unknown robot, program or name; or there is a file already.
        OSError: The file cannot be written.
    """
    text, chosen = layout_text(robot, program, name, fleet=fleet), PROGRAMS[program]
    called = robot if fleet else viewed_robot(robot, name).name
    path = file or Path(f"{called}{chosen.suffix}")
    if path.exists() and not force:
        raise ConfigError(f"{path} exists already. Give --out another file, or --force to replace it.")
    if not path.parent.is_dir():
        raise ConfigError(f"{path.parent} is no folder. Make it first, or give --out another file.")
    write_whole({path: text.encode()})
    return path, chosen.opening.format(file=path)
