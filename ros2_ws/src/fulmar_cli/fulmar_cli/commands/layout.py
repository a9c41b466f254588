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
        str | None, argument("[ROBOT|FILE]", "A name from `fulmar list robots`, or a robot's .yaml file.")
    ] = None,
    system: Annotated[
        str | None, option("FLEET", "A fleet from `fulmar list systems`: a layout with every robot.")
    ] = None,
    name: NameOption = None,
    program: Annotated[str, option("rviz|foxglove", "The program to open it with.", "--for")] = "rviz",
    out: Annotated[
        str | None,
        option("FILE", "ROBOT.rviz or ROBOT.json in the current folder by default; - prints it."),
    ] = None,
    force: Annotated[bool, flag("--force", "Replace the file.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Write a layout for RViz or Foxglove: robot or fleet, goal, markers, plots, a click that gives a goal.

    It has the topics, services and frames of the robot, with its name, and the quality of service of each topic.
    `fulmar up` publishes all of them; the buttons of the e-stop need `fulmar up --estop`.

    Exit code: 0 written, 2 unknown robot or program, or the file exists.

    Try:

    fulmar layout floating_platform

    fulmar layout turtlebot2 --name alpha --for foxglove

    fulmar layout mine/robots/hexbot.yaml --out -

    fulmar layout --system fleet --for foxglove
    """
    from fulmar_bringup.layouts.layout_file import layout_text, write_layout

    if (robot is None) == (system is None):
        raise ConfigError(
            "say which robot: fulmar layout ROBOT; or which fleet: fulmar layout --system FLEET."
        )
    if system is not None and name is not None:
        raise ConfigError(f"--system {system} takes no --name: the fleet's file says it for each robot.")
    shown, fleet = system or robot or "", system is not None
    if out == STDOUT:
        if as_json:
            raise ConfigError("--out - prints the layout itself; leave --json out.")
        sys.stdout.write(layout_text(shown, program, name, fleet=fleet))
        return
    path = Path(out) if out else None
    file, opening = write_layout(shown, program, name, file=path, force=force, fleet=fleet)
    print_result(
        {"file": str(file), "program": program, "open": opening},
        lambda _: write_line(f"wrote {file}. Open it: {opening}"),
        as_json=as_json,
    )
