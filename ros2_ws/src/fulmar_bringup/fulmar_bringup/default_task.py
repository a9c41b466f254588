"""The task of a run that names none: the kind of its goal decides."""

from __future__ import annotations

from pathlib import Path

from fulmar_bringup.goal_plan import task_of_goals
from fulmar_bringup.system import default_hardware
from fulmar_core.errors import ConfigError
from fulmar_core.robot import load_robot
from fulmar_core.tasks import load_task
from policy_server.controllers import CONTROLLERS, shipped_policy

POSE, POSITION = "go_to_pose", "go_to_position"
OPTIONS = {POSE: "--goal x,y,deg", POSITION: "--goal x,y"}


def task_of_run(
    task: str | None,
    robot: str,
    controller: str,
    backend: str,
    *,
    goal: tuple[float, ...] | None,
    goals: str | None,
    policy: Path | None,
) -> tuple[str, str]:
    """Name of the task of a run, and a note where a part of its goal has no effect.

    Args:
        task: Name of the task, if one was given.
        robot: Name of the robot.
        controller: Name of the controller.
        backend: Name of the backend.
        goal: x [m], y [m] and, for a pose, heading [deg].
        goals: Name or path of a goal file; without a task it decides.
        policy: Bundle that was given.

    Raises:
        ConfigError: As of `default_task` and `check_heading`.
    """
    if task is not None:
        return task, "" if goal is None else check_heading(task, goal)
    if goals:
        return task_of_goals(goals), ""
    return default_task(robot, controller, backend, goal=goal, policy=policy), ""


def default_task(
    robot: str,
    controller: str,
    backend: str = "mujoco",
    *,
    goal: tuple[float, ...] | None = None,
    policy: Path | None = None,
) -> str:
    """Name of the task that a goal asks for: two numbers are a position, three a pose; without a goal it is a pose.

    Args:
        robot: Name of the robot.
        controller: Name of the controller.
        backend: Name of the backend.
        goal: x [m], y [m] and, for a pose, heading [deg].
        policy: Bundle that was given; it is checked against the task later.

    Raises:
        ConfigError: The controller does not do that task with this robot, but another one; with what to say instead.
    """
    if backend == "hardware":
        default_hardware(robot)
    asked = POSITION if goal is not None and len(goal) == 2 else POSE
    reason = why_not(robot, asked, controller, policy)
    if not reason:
        return asked
    other = POSE if asked == POSITION else POSITION
    instead = []
    if not why_not(robot, other, controller, policy):
        instead.append(f"--task {other} or {OPTIONS[other]}")
    if controller != "classical" and not why_not(robot, asked, "classical", None):
        instead.append("--controller classical")
    if not instead:
        return asked  # the plan is refused with the reason, which no other task changes
    what = "without --task and --goal" if goal is None else f"with --goal {','.join(f'{x:g}' for x in goal)}"
    raise ConfigError(f"a run {what} is {asked}: {reason} Say {', or '.join(instead)}.")


def why_not(robot: str, task: str, controller: str, policy: Path | None) -> str:
    """Why a controller does not do a task with a robot; empty if it does, or if there is no such controller."""
    if controller not in CONTROLLERS:
        return ""
    entry = CONTROLLERS[controller]
    try:
        entry.check(load_robot(robot), load_task(task))
    except ConfigError as error:
        return str(error)
    if entry.runs_bundle and policy is None and shipped_policy(robot, task) is None:
        return f"no policy is shipped for '{robot}' and '{task}'."
    return ""


def check_heading(task: str, goal: tuple[float, ...]) -> str:
    """What a goal says too much for a task that was named; empty if nothing.

    Raises:
        ConfigError: The task needs a heading, and the goal has none.
    """
    wants = load_task(task).goal_topic
    if len(goal) == 2 and wants == "goal_pose":
        raise ConfigError(f"task '{task}' needs a heading: --goal x,y,deg. Or use --task {POSITION}.")
    if len(goal) == 3 and wants == "goal_point":
        return f"task '{task}' has no heading: the {goal[2]:g} deg of --goal have no effect"
    return ""
