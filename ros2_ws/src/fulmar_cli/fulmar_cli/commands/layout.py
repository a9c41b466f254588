"""`fulmar layout`: a layout of RViz or Foxglove for one robot."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from fulmar_bringup.console import print_result, write_line
from fulmar_cli.commands.arguments import JsonOption, NameOption, argument, flag, option
from fulmar_core.config.errors import ConfigError

STDOUT = "-"


def layout(
    robot: Annotated[
        str, argument("ROBOT|FILE", "A name from `fulmar list robots`, or a robot's .yaml file.")
    ],
    name: NameOption = None,
    program: Annotated[str, option("rviz|foxglove", "The program to open it with.", "--for")] = "rviz",
    out: Annotated[
        str | None,
        option("FILE", "ROBOT.rviz or ROBOT.json in the current folder by default; - prints it."),
    ] = None,
    force: Annotated[bool, flag("--force", "Replace the file.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Write a layout for RViz or Foxglove: robot, goal, markers, plots, a click that gives a goal.

    It has the topics, services and frames of the robot, with its name, and the quality of service of each topic.
    `fulmar up` publishes all of them; the buttons of the e-stop need `fulmar up --estop`.

    Exit code: 0 written, 2 unknown robot or program, or the file exists.

    Try:

    fulmar layout floating_platform

    fulmar layout turtlebot2 --name alpha --for foxglove

    fulmar layout mine/robots/hexbot.yaml --out -
    """
    from fulmar_bringup.layouts.layout_file import layout_text, write_layout

    if out == STDOUT:
        if as_json:
            raise ConfigError("--out - prints the layout itself; leave --json out.")
        sys.stdout.write(layout_text(robot, program, name))
        return
    file, opening = write_layout(robot, program, name, file=Path(out) if out else None, force=force)
    print_result(
        {"file": str(file), "program": program, "open": opening},
        lambda _: write_line(f"wrote {file}. Open it: {opening}"),
        as_json=as_json,
    )
