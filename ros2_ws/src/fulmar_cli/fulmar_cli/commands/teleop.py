"""`fulmar teleop`: drive a running robot by hand."""

from __future__ import annotations

from typing import Annotated

import typer

from fulmar_bringup.console import write_line
from fulmar_cli.commands.arguments import NameOption, RobotArgument, flag, option
from fulmar_core.config.errors import FAILED, RunFailed
from fulmar_core.wires.robot_name import namespace_of


def teleop(
    robot: RobotArgument,
    name: NameOption = None,
    keyboard: Annotated[
        bool, flag("--keyboard/--no-keyboard", "Read keys from this terminal, beside the topic joy.")
    ] = True,
    share: Annotated[
        float, option("F", "Share of the robot's limits at full deflection.", min=0.01, max=1.0)
    ] = 0.5,
    give_back: Annotated[bool, flag("--give-back", "Only return the robot to its controller.")] = False,
) -> None:
    """Drive a running robot by keyboard or gamepad, with priority over the controller.

    Hold a key or the gamepad's left shoulder button: that is the dead-man switch. When it is released or this command
    dies, the actuators go to their safe state: robots on wheels or in water stop, robots that float drift on. The
    controller takes over again with g, with the right shoulder button, or with --give-back; x ends this command and
    leaves the robot in its safe state. In space, keys push along x and y and turn about z only.

    Try:

    fulmar teleop turtlebot2

    fulmar teleop kingfisher --no-keyboard --share 1
    """
    from fulmar_bringup.processes import command_line
    from fulmar_bringup.teleop_row import teleop_spec
    from fulmar_core.robots.robot_file import load_robot
    from fulmar_core.robots.topics import GIVE_BACK

    load_robot(robot)  # rejects a wrong name
    name = name or robot
    space = namespace_of(name)
    if give_back:
        from fulmar_bringup.robot_operator import FIND_S, operator

        with operator() as person:
            if not person.robots_with(GIVE_BACK, name, wait_s=FIND_S):
                raise RunFailed(
                    f"no plant of '{name}' publishes in this ROS domain. {person.running_robots_text()}"
                )
            done, words = person.ask(f"{space}/{GIVE_BACK}")
        write_line(words)
        raise typer.Exit(0 if done else FAILED)
    spec = teleop_spec(robot, name=name, keyboard=keyboard, share=share)
    from fulmar_ros.runtime import run_node
    from fulmar_ros.teleop_node import TeleopNode

    _, _, _, *arguments = command_line(spec)  # python -m module
    raise typer.Exit(run_node(TeleopNode, arguments))
