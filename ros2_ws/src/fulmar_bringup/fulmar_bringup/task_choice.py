"""The task of a run, as its goal, its goal file or its robot asks for."""

from __future__ import annotations

from dataclasses import replace
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
from fulmar_core.tasks.goal_files import GoalFile, Poses, Positions, Trajectory, load_goal_file, single_goal
from fulmar_core.tasks.goal_numbers import GOAL, goes_to_places, names_of, whole_pose, written
from fulmar_core.tasks.goal_words import attitude_words
from policy_server.controllers import CLASSICAL, CONTROLLERS, shipped_policy, usual_controller

POSITION_OPTION = "--position"  # of `fulmar goals`
POSE, POSITION = "go_to_pose", "go_to_position"
DEFAULT_TASKS = {Positions: POSITION, Poses: POSE}  # all others are about velocities
EXCITED = "point_inertial"  # while a satellite plays torques


def goal_options(form: type[State]) -> dict[str, str]:
    """What to say for a pose and for a position, by the names of the tasks."""
    pose, place = ",".join(form.NUMBERS), ",".join(form.NUMBERS[: form.AXES])
    return {POSE + form.SUFFIX: f"--goal {pose}", POSITION + form.SUFFIX: f"--goal {place}"}


def task_of(plan: RunPlan) -> str:
    """Name of the task of a plan: the one that is given, or what its goal, its goal file or its robot asks for.

    Raises:
        ConfigError: As in `default_task`, or the kind of robot has nothing to do with what is asked for.
    """
    if plan.task:
        return plan.task
    robot = load_robot(plan.robot)
    kind = robot.kind
    if plan.goals:
        asked = task_of_goals(plan.goals)
        return kind.goal_task if asked == POSE + SpatialState.SUFFIX and not kind.goes_anywhere else asked
    for option, value, task in (
        ("--velocity", plan.velocity, kind.velocity_task),
        ("--height", plan.height, kind.height_task),
    ):
        if value and not task:
            raise ConfigError(
                f"{option} is not for {kind.plural} such as '{robot.name}'. Leave it out, or name a task with --task."
            )
        if value:
            return task
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
        whole_pose(plan.goal, robot, GOAL)
        places = plan.task and "x" in names_of(plan.goal, robot, GOAL)
        return check_heading(plan.task, plan.goal) if places else ""
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
    """Name of the task that a goal asks for: a place is a position, with angles it is a pose.

    Without a goal it is the first of the kind's usual tasks that the controller does with this robot; a satellite
    points to the Earth, an aircraft holds its height.

    The goal has the numbers that were given; a bundle that was given is checked later. Without a hardware file the
    robot has to have its own.

    Raises:
        ConfigError: The controller does not do that task with this robot, but another one, or the goal could be meant
            otherwise; with what to say instead.
    """
    if backend == "hardware":
        default_hardware(robot, hardware)
    the_robot = load_robot(robot)
    kind = the_robot.kind
    if goal is None:
        usual = [task for task in (kind.usual_task, kind.other_task) if task]
        able = [task for task in usual if not _unable(robot, task)] or usual
        return next((task for task in able if not why_not(robot, task, controller, policy)), able[0])
    counts, reason = kind.asked_back
    if len(goal) in counts:
        raise ConfigError(
            f"--goal {written(goal)} has {len(goal)} numbers: '{robot}' is one of the {kind.plural}, {reason}."
        )
    if kind.goal_task:
        return kind.goal_task
    form = kind.state_type
    pose, position = (name + form.SUFFIX for name in (POSE, POSITION))
    asked, other = (position, pose) if len(goal) == form.AXES else (pose, position)
    reason = why_not(robot, asked, controller, policy)
    if not reason:
        return asked
    instead = []
    if not why_not(robot, other, controller, policy):
        instead.append(f"--task {other} or {goal_options(form)[other]}")
    if controller != CLASSICAL and not why_not(robot, asked, CLASSICAL, None):
        instead.append(f"--controller {CLASSICAL}")
    if not instead:
        return asked  # the plan is refused with the reason, which no other task changes
    raise ConfigError(f"a run with --goal {written(goal)} is {asked}: {reason} Say {', or '.join(instead)}.")


def single_file(numbers: tuple[float, ...], option: str, robot: Robot) -> GoalFile:
    """One goal of `fulmar goals` as its file would hold it: a position [m], or a pose or an attitude [m, deg].

    Raises:
        ConfigError: As in `whole_pose`; or so many numbers could be meant otherwise, or are no position.
    """
    pose, form, kind = whole_pose(numbers, robot, option), robot.state_type, robot.kind
    if option == POSITION_OPTION:
        if len(numbers) != form.AXES or not kind.goes_anywhere:
            raise ConfigError(
                f"{option} {written(numbers)} is no position of '{robot.name}', which moves in {form.WORLD}: "
                f"{','.join(form.NUMBERS[: form.AXES])} [m], or give --pose {','.join(kind.goal_forms[0])}."
            )
        return single_goal(numbers, form)
    if kind.goes_anywhere and len(numbers) in kind.asked_back[0]:
        raise ConfigError(
            f"{option} {written(numbers)} has {len(numbers)} numbers, and '{robot.name}' is one of the {kind.plural}: "
            f"its poses have {len(form.NUMBERS)}, {','.join(form.NUMBERS)} [m, deg]. For a place with any attitude "
            f"give {POSITION_OPTION} {written(numbers)}."
        )
    if not goes_to_places(robot, option):
        return replace(single_goal(pose, form), title=attitude_words(form, pose))
    return single_goal(numbers if len(numbers) == form.AXES else pose, form)


def why_not(robot: str, task: str, controller: str, policy: Path | None) -> str:
    """Why a controller does not do a task with a robot; empty if it does, or if there is no such controller.

    An empty name stands for the usual controller of the pair.
    """
    the_robot, the_task = load_robot(robot), load_task(task)
    controller = controller or usual_controller(the_robot, the_task, str(policy or ""))
    if controller not in CONTROLLERS:
        return _unable(robot, task)
    entry = CONTROLLERS[controller]
    try:
        the_task.check(the_robot)
        entry.check(the_robot, the_task)
    except ConfigError as error:
        return str(error)
    if entry.runs_bundle and policy is None and shipped_policy(robot, task) is None:
        return f"no policy is shipped for '{robot}' and '{task}'."
    return ""


def _unable(robot: str, task: str) -> str:
    """Why a robot cannot do a task, whatever controls it; empty if it can."""
    try:
        load_task(task).check(load_robot(robot))
    except ConfigError as error:
        return str(error)
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
