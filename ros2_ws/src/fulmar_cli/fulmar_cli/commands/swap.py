"""`fulmar swap`: replace the policy of a running robot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fulmar_bringup.console import print_json, write_line
from fulmar_cli.commands.arguments import JsonOption, argument
from fulmar_core.config.errors import FAILED
from fulmar_core.config.paths import config_names
from fulmar_core.wires.robot_name import checked_name

FIND_S, LOAD_S = 5.0, 20.0


def swap(
    robot: Annotated[str, argument("ROBOT", "Name of the running robot: its type, or its --name.")],
    folder: Annotated[Path, argument("DIR", "A policy bundle, on the robot's own disk.")],
    as_json: JsonOption = False,
) -> None:
    """Replace the policy of a running robot.

    It is loaded and warmed up beside the one that runs, and takes over between two commands. A bundle that is damaged,
    for another robot, task or rate, or not signed where a signature is required, is refused, and the running policy
    goes on. Exit code 1 then.

    Try:

    fulmar swap floating_platform runs/bundles/go_to_pose
    """
    from fulmar_bringup.robot_operator import operator

    if robot not in config_names("robots"):
        checked_name(robot)
    with operator() as person:
        sent = str(folder.absolute())
        answer = person.say_swap(robot, sent, find_s=FIND_S, answer_s=LOAD_S)
    done = answer.startswith("done")
    if as_json:
        print_json({"robot": robot, "policy": sent, "done": done, "said": answer})
    else:
        write_line(answer)
    if not done:
        raise typer.Exit(FAILED)
