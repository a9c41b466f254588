"""`fulmar goals`: tell a running robot, from a file, where to go or how to move."""

from __future__ import annotations

from typing import Annotated

import typer

from fulmar_bringup.commands.list import list_names
from fulmar_core.errors import ConfigError

GIVE_UP_S = 5.0  # without odometry or without a subscriber of the goals


def goals(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="NAME",
            help="A name from `fulmar list goals`, or a path that ends in .yaml; without it they are listed.",
        ),
    ] = None,
    robot: Annotated[
        str | None, typer.Option(metavar="R", help="Who is to do it: a name from `fulmar list robots`.")
    ] = None,
    as_path: Annotated[
        bool,
        typer.Option(
            "--as-path", help="Tell all positions or poses at once, for tasks that pass through them."
        ),
    ] = False,
    control_hz: Annotated[
        float, typer.Option(metavar="HZ", min=0.01, help="Velocities come so often along a path.")
    ] = 10.0,
    wait: Annotated[
        bool,
        typer.Option("--wait", help=f"Wait for the robot and its controller; {GIVE_UP_S:g} s by default."),
    ] = False,
) -> None:
    """Tell a running robot its goals, one after the other, until they are done or Ctrl-C.

    Positions, poses, velocities by the clock, or a path to follow: a file in configs/goals says which. The robot must
    be up, with a controller whose task takes such goals; velocities end in standstill.

    Try, in one terminal:

    fulmar run floating_platform --task track_velocities --duration 120

    and in another:

    fulmar goals lab_circle --robot floating_platform

    Exit code: 0 done, or stopped by Ctrl-C, 1 there is no robot or no controller that takes such goals.
    """
    if name is None:
        list_names("goals")
        return
    if robot is None:
        raise ConfigError(f"whose goals? Example: fulmar goals {name} --robot floating_platform")
    from fulmar_bringup.goal_plan import check_pace
    from fulmar_bringup.node_table import goals_spec
    from fulmar_bringup.processes import command_line
    from fulmar_core.goal_files import load_goals
    from fulmar_core.goal_sequence import goal_sequence
    from fulmar_core.robot import load_robot

    file, the_robot = load_goals(name), load_robot(robot)
    goal_sequence(file, the_robot, as_path=as_path)  # whatever is wrong is said in one line
    check_pace(file, name, the_robot)
    spec = goals_spec(
        robot, name, as_path=as_path, control_hz=control_hz, give_up_s=0.0 if wait else GIVE_UP_S
    )
    from fulmar_ros.goal_node import GoalNode
    from fulmar_ros.runtime import run_node

    _, _, _, *arguments = command_line(spec)  # python -m module
    raise typer.Exit(run_node(GoalNode, arguments))
