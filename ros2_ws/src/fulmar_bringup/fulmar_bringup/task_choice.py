"""The task of a run, as its goal, its goal file or its robot asks for."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fulmar_bringup.excitation_plan import torques_note
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system import default_hardware
from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.spatial import SpatialState
from fulmar_core.states.state import State
from fulmar_core.tasks import load_task
from fulmar_core.tasks.excitation import Torques
from fulmar_core.tasks.goal import PoseTuple
from fulmar_core.tasks.goal_files import Poses, Positions, Trajectory, load_goal_file
from policy_server.controllers import CONTROLLERS, shipped_policy

POSE, POSITION = "go_to_pose", "go_to_position"
DEFAULT_TASKS = {Positions: POSITION, Poses: POSE}  # all others are about velocities
EXCITED = "point_inertial"  # while a satellite plays torques


def goal_options(form: type[State]) -> dict[str, str]:
    """What to say for a pose and for a position, by the names of the tasks."""
    pose, place = ",".join(form.NUMBERS), ",".join(form.NUMBERS[: form.AXES])
    return {POSE + form.SUFFIX: f"--goal {pose}", POSITION + form.SUFFIX: f"--goal {place}"}


def whole_pose(numbers: Sequence[float], robot: Robot, option: str) -> PoseTuple:
    """A pose as people write it, with angles of 0 where there are none.

    Args:
        numbers: A place [m], or a pose [m, deg].
        robot: Whose pose it is.
        option: What gave it.

    Raises:
        ConfigError: So many numbers are neither, for such a robot.
    """
    form = robot.state_type
    if len(numbers) not in (form.AXES, len(form.NUMBERS)):
        given = ",".join(f"{number:g}" for number in numbers)
        raise ConfigError(
            f"{option} = '{given}' has {len(numbers)} numbers; '{robot.name}' moves in {form.WORLD}: "
            f"{form.AXES} ({','.join(form.NUMBERS[: form.AXES])}) or {len(form.NUMBERS)} "
            f"({','.join(form.NUMBERS)}) are needed [m, deg]."
        )
    return (*numbers, *[0.0] * (len(form.NUMBERS) - len(numbers)))


def task_of(plan: RunPlan) -> str:
    """Name of the task of a plan: the one that is given, or what its goal, its goal file or its robot asks for.

    Raises:
        ConfigError: As in `default_task`.
    """
    if plan.task:
        return plan.task
    if plan.goals:
        kind, asked = load_robot(plan.robot).kind, task_of_goals(plan.goals)
        return kind.goal_task if asked == POSE + SpatialState.SUFFIX and not kind.goes_anywhere else asked
    policy, hardware = Path(plan.policy) if plan.policy else None, plan.hardware or None
    return default_task(
        plan.robot, plan.controller, plan.backend, goal=plan.goal, policy=policy, hardware=hardware
    )


def goal_note(plan: RunPlan) -> str:
    """Warning about a part of a plan's goal that has no effect, or that asks much; empty if there is none.

    Raises:
        ConfigError: As in `whole_pose`, `check_heading` and `excitation_of`.
    """
    robot = load_robot(plan.robot)
    if plan.goal is not None:
        whole_pose(plan.goal, robot, "--goal")
        return check_heading(plan.task, plan.goal) if plan.task else ""
    return torques_note(plan.goals, robot, plan.controller)


def default_task(
    robot: str,
    controller: str,
    backend: str = "mujoco",
    *,
    goal: tuple[float, ...] | None = None,
    policy: Path | None = None,
    hardware: str | None = None,
) -> str:
    """Name of the task that a goal asks for: a place is a position, with angles it is a pose, as without a goal.

    A satellite turns to a goal, and without one points to the Earth. An aircraft holds its height.

    The goal is as `State.NUMBERS` of the robot; a bundle that was given is checked later. Without a hardware file the
    robot has to have its own.

    Raises:
        ConfigError: The controller does not do that task with this robot, but another one; with what to say instead.
    """
    if backend == "hardware":
        default_hardware(robot, hardware)
    kind = load_robot(robot).kind
    if kind.goal_task:
        return kind.usual_task if goal is None else kind.goal_task
    form = kind.state_type
    pose, position = (name + form.SUFFIX for name in (POSE, POSITION))
    asked = position if goal is not None and len(goal) == form.AXES else pose
    reason = why_not(robot, asked, controller, policy)
    if not reason:
        return asked
    other = pose if asked == position else position
    reason_of_other = why_not(robot, other, controller, policy)
    if reason == reason_of_other:
        return asked  # not for this robot, whatever the task: the plan is refused with what is
    instead = []
    if not reason_of_other:
        instead.append(f"--task {other} or {goal_options(form)[other]}")
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
    """Warning about a heading or attitude that a named task does not use; empty if there is none.

    Raises:
        ConfigError: The task needs one, and the goal has none.
    """
    found = load_task(task)
    wants, form = found.goal_topic, found.state_type
    what = "heading" if form is PlanarState else "attitude"
    angles = goal[form.AXES :]
    if not angles and wants == "goal_pose":
        usual = POSITION + form.SUFFIX
        raise ConfigError(
            f"task '{task}' needs a{'n' if what == 'attitude' else ''} {what}: --goal {','.join(form.NUMBERS)}. "
            f"Or use --task {usual}."
        )
    if angles and wants == "goal_point":
        given = ", ".join(f"{angle:g}" for angle in angles)
        return f"task '{task}' has no {what}: the {given} deg of --goal have no effect"
    return ""


def task_of_goals(goals: str) -> str:
    """Name of the task whose controller takes the goals of a file.

    Raises:
        ConfigError: Unknown name, or a mistake in the file.
    """
    file = load_goal_file(goals)
    if isinstance(file, Torques):
        return EXCITED
    if isinstance(file, Trajectory):
        return (POSITION if file.facing == "any" else POSE) + file.form.SUFFIX
    return DEFAULT_TASKS.get(type(file), "track_velocities") + file.form.SUFFIX
