"""`fulmar swap`: change the controller of a running robot."""

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
    controller: Annotated[
        str,
        argument(
            "CONTROLLER|DIR",
            "policy, a law such as lqr, fallback or teleoperation; or a policy bundle on the robot's own disk.",
        ),
    ],
    as_json: JsonOption = False,
) -> None:
    """Change the controller of a running robot.

    The new one is loaded and warmed up beside the one that runs, and takes over between two commands. A name that the
    robot has no controller for, and a bundle that is damaged, for another robot, task or rate, or not signed where a
    signature is required, is refused, and the running controller goes on. Exit code 1 then. With teleoperation the
    actuators rest, and a person may drive.

    Try:

    fulmar swap floating_platform lqr

    fulmar swap floating_platform runs/bundles/go_to_pose
    """
    from fulmar_bringup.robot_operator import operator

    if robot not in config_names("robots"):
        checked_name(robot)
    folder = "" if is_name(controller) else str(Path(controller).absolute())
    name = "" if folder else controller
    with operator() as person:
        answer = person.ask_swap(robot, controller=name, bundle=folder, find_s=FIND_S, answer_s=LOAD_S)
    words = f"{'done' if answer.accepted else 'refused'} {controller}: {answer.reason}"
    if as_json:
        print_json(
            {
                "robot": robot,
                "controller": name,
                "policy": folder,
                "done": answer.accepted,
                "said": words,
                "reason": answer.reason,
                "sha256": answer.sha256,
            }
        )
    else:
        write_line(words)
    if not answer.accepted:
        raise typer.Exit(FAILED)


def is_name(text: str) -> bool:
    """Whether a text names a controller: one that robots have, or no folder that is here; a slash makes it a folder."""
    from fulmar_core.loop.controller_choices import CLASSICAL, FALLBACK, NAMED, TELEOPERATION
    from fulmar_core.loop.controller_settings import POLICY

    known = text in (*NAMED, POLICY, CLASSICAL, FALLBACK, TELEOPERATION)
    return known or not ("/" in text or Path(text).is_dir())
