"""`fulmar goals`: send a running robot goals, from a file or one from the command line."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from fulmar_bringup.console import log_line
from fulmar_cli.commands.arguments import NameOption, argument, flag, option
from fulmar_cli.commands.list import list_names
from fulmar_cli.commands.values import read_area, read_goal
from fulmar_core.config.errors import ConfigError

if TYPE_CHECKING:
    from fulmar_core.robots.robot import Robot
    from fulmar_core.tasks.goal_files import GoalFile

GIVE_UP_S = 5.0  # without odometry or without a subscriber of the goals


def goals(
    name: Annotated[
        str | None,
        argument(
            "NAME",
            "A name from `fulmar list goals`, or a path that ends in .yaml; without it they are listed.",
        ),
    ] = None,
    robot: Annotated[str | None, option("R", "Type of the robot: a name from `fulmar list robots`.")] = None,
    robot_name: NameOption = None,
    pose: Annotated[
        str | None,
        option(
            "X,Y,DEG",
            "One goal instead of a file: x [m], y [m], heading [deg], or x,y for a position; in space "
            "x,y,z,roll,pitch,yaw [m, deg], of satellites roll,pitch,yaw; a position x,y,z has --position.",
            "--pose",
        ),
    ] = None,
    position: Annotated[
        str | None, option("X,Y[,Z]", "One position instead of a file [m].", "--position")
    ] = None,
    as_path: Annotated[
        bool, flag("--as-path", "Send all positions or poses at once, for tasks that pass through them.")
    ] = False,
    area: Annotated[
        str | None,
        option(
            "x,x,y,y", "Send no goal outside: x_min, x_max, y_min, y_max, in space also z_min, z_max [m]."
        ),
    ] = None,
    control_hz: Annotated[float, option("HZ", "Rate of velocities along a path.", min=0.01)] = 10.0,
    wait: Annotated[
        bool, flag("--wait", f"Wait for the robot and its controller; {GIVE_UP_S:g} s by default.")
    ] = False,
) -> None:
    """Send a running robot its goals, one after the other, until they are done or Ctrl-C.

    Positions, poses, velocities by the clock, or a path to follow: from a file in configs/goals; or one pose or
    position from the command line. The robot must be up, with a controller whose task takes such goals; velocities end
    in standstill.

    Try, in one terminal:

    fulmar run floating_platform --task track_velocities --duration 120

    and in another:

    fulmar goals lab_circle --robot floating_platform

    or, where the robot's task is go_to_pose:

    fulmar goals --robot floating_platform --pose 1,-0.5,90

    fulmar goals --robot spacecraft_16 --pose 1,0,-0.5,0,30,90

    Exit code: 0 done, or stopped by Ctrl-C, 1 there is no robot or no controller that takes such goals.
    """
    if name is None and pose is None and position is None:
        list_names("goals")
        return
    option, text = _one_of(name, pose, position)
    if robot is None:
        example = name if text is None else f"{option} {text}"
        raise ConfigError(f"whose goals? Example: fulmar goals {example} --robot floating_platform")
    from fulmar_bringup.goal_plan import check_file_places, check_pace
    from fulmar_bringup.goals_row import goals_spec
    from fulmar_bringup.processes import command_line
    from fulmar_core.robots.robot_file import load_robot
    from fulmar_core.safety.geofence import NO_AREA, check_area_of
    from fulmar_core.tasks.goal_files import load_goals
    from fulmar_core.tasks.goal_sequence import goal_sequence
    from fulmar_ros.goal_node import GoalNode
    from fulmar_ros.runtime import run_node

    the_robot = load_robot(robot)
    inside = read_area(area) or NO_AREA
    check_area_of(the_robot, inside)
    single = None if text is None else _single(text, option, the_robot)
    file = single or load_goals(name or "")
    goal_sequence(file, the_robot, as_path=as_path)  # rejects goals that the robot cannot have
    check_pace(file, name or "", the_robot, min(control_hz, the_robot.timing.control_hz))
    check_file_places(file, name or "", the_robot, inside)
    log_line(f"goal: {file.title}; robot {robot_name or robot}")
    spec = goals_spec(
        robot,
        name or "",
        name=robot_name or "",
        as_path=as_path,
        control_hz=control_hz,
        give_up_s=0.0 if wait else GIVE_UP_S,
    )
    _, _, _, *arguments = command_line(spec)  # python -m module
    raise typer.Exit(run_node(lambda request_exit: GoalNode(request_exit, goals=single), arguments))


def _one_of(name: str | None, pose: str | None, position: str | None) -> tuple[str, str | None]:
    """The option that gives one goal, and its text; empty and None for a file.

    Raises:
        ConfigError: There are two goals.
    """
    options = {"--pose": pose, "--position": position}
    given = {option: text for option, text in options.items() if text is not None}
    both = [*([f"'{name}'"] if name else []), *given]
    if len(both) > 1:
        raise ConfigError(f"{' and '.join(both)} are two goals: give one of them.")
    return next(iter(given.items()), ("", None))


def _single(text: str, option: str, robot: Robot) -> GoalFile:
    """The one goal of --pose or --position, which numbers of another kind of robot are not."""
    from fulmar_bringup.task_choice import single_file

    return single_file(read_goal(text, option, robot.name) or (), option, robot)
