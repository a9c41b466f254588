"""`fulmar teleop`: take a running robot by hand."""

from __future__ import annotations

from typing import Annotated

import typer

from fulmar_bringup.console import output
from fulmar_cli.commands.arguments import NameOption, RobotArgument
from fulmar_core.errors import FAILED, RunFailed
from fulmar_core.robot_name import checked_name, namespace_of


def teleop(
    robot: RobotArgument,
    name: NameOption = None,
    keyboard: Annotated[
        bool,
        typer.Option("--keyboard/--no-keyboard", help="Read keys from this terminal, beside the topic joy."),
    ] = True,
    share: Annotated[
        float, typer.Option(metavar="F", min=0.01, max=1.0, help="Of what the robot can, at full wish.")
    ] = 0.5,
    give_back: Annotated[
        bool, typer.Option("--give-back", help="Only give the robot back to its controller.")
    ] = False,
) -> None:
    """Drive a running robot by keyboard or gamepad; a hand goes before the controller.

    Hold a key, or the gamepad's left shoulder button: that is the dead-man switch. Let go, and the robot stands still;
    so it does if this command dies. The controller gets it back with g, with the right shoulder button, or with
    --give-back.

    Try:

    fulmar teleop turtlebot2

    fulmar teleop kingfisher --no-keyboard --share 1
    """
    from fulmar_bringup.node_table import teleop_spec
    from fulmar_bringup.processes import command_line
    from fulmar_core.robot import load_robot
    from fulmar_core.topics import GIVE_BACK

    load_robot(robot)  # a wrong name is told in one line
    name = robot if name is None else checked_name(name)
    space = namespace_of(name)
    if give_back:
        from fulmar_bringup.robot_operator import FIND_S, operator

        with operator() as person:
            if not person.robots_with(GIVE_BACK, name, wait_s=FIND_S):
                raise RunFailed(
                    f"no plant of '{name}' is heard in this ROS domain. {person.running_robots_text()}"
                )
            done, words = person.ask(f"{space}/{GIVE_BACK}")
        output.print(words, markup=False)
        raise typer.Exit(0 if done else FAILED)
    spec = teleop_spec(robot, name=name, keyboard=keyboard, share=share)
    from fulmar_ros.runtime import run_node
    from fulmar_ros.teleop_node import TeleopNode

    _, _, _, *arguments = command_line(spec)  # python -m module
    raise typer.Exit(run_node(TeleopNode, arguments))
