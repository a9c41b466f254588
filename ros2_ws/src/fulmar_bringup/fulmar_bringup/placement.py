"""Where a run begins and where it goes: as given, as its goal file says, or as the seed draws it inside the area."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fulmar_bringup.goal_plan import check_pace, first_targets, start_of
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.config.errors import ConfigError
from fulmar_core.dynamics.flight_trim import find_trim
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.geofence import check_places, farthest_goal, unreachable
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.tasks import Task
from fulmar_core.tasks.goal import PLACES, Goal, PoseTuple
from fulmar_core.tasks.goal_files import GoalFile, HeldVelocity, Velocities
from fulmar_core.tasks.goal_numbers import GOAL, goes_to_places, written
from fulmar_core.tasks.goal_words import counted
from fulmar_core.worlds.scenario import load_scenario

FAR = 10.0  # times its geofence: how far from the origin a goal without a start may lie [-]
VELOCITY = ", or --velocity gives one"
DRAWS = 1000  # of a start and a goal, before an area counts as too small for them


def placed(plan: RunPlan, file: GoalFile | None, task: Task) -> tuple[Goal, PoseTuple]:
    """The goal and the start of a plan, both inside the area; what was not given is drawn until it is.

    The first draw is the seed's episode. It stays where the task has obstacles or things: the plant draws the
    same ones.

    Args:
        plan: What was given. A standing system gets its goals later, and a real robot starts where it stands.
        file: Goals from a file, which were checked.
        task: That of the plan, at its height.

    Raises:
        ConfigError: What was given is outside, or no draw is inside.
    """
    robot, scenario = load_robot(plan.robot), load_scenario(plan.scenario)
    area, farthest = plan.guards.area, farthest_goal(robot)
    if plan.height > farthest:
        raise ConfigError(
            f"--height = {plan.height:g} m is too high: at most {farthest:,.0f} m from the origin."
        )
    if plan.goal is not None:  # numbers of a pose, of which a place is at the front
        check_places("the goal", [plan.goal], area, farthest)
        _check_nearness(plan, robot)
    if plan.start and not plan.is_real:
        check_places("the start", [plan.start], area, farthest)
    fixed = start_of(file) if file is not None else None
    if fixed is not None and not plan.start and not plan.is_real:
        check_places("the start of these goals", [fixed], area, farthest)
    before = ""
    for number in range(DRAWS):
        episode = draw_episode(robot, task, scenario, seed=plan.seed, number=number)
        mission, drawn = episode.goal, task.state_type.written(episode.start.pose)
        if file is not None:
            mission, drawn = _from_file(file, mission, drawn)
        elif plan.goal is not None:
            mission, drawn = _moved(task, mission, drawn, plan.goal, placed=goes_to_places(robot, GOAL))
        elif plan.velocity:
            mission = replace(mission, targets=velocity_target(plan.velocity, robot, task)[None])
        goes = not plan.standing and task.goal_topic != "goal_velocity"
        targets = mission.targets.tolist() if goes else []
        starts = [] if plan.is_real else [plan.start or drawn]
        problem = unreachable("the drawn goal", targets, area, farthest) or unreachable(
            "the drawn start", starts, area, farthest
        )
        if task.structures:
            problem = problem or task.goal_problem(targets) or task.kept_out("the start", starts)
        if not problem:
            return mission, drawn
        if mission.obstacles.size or task.things or problem == before:  # the same each time, as of wings
            break
        before = problem
    raise ConfigError(f"{problem} Give --start and --goal, another --seed, or a larger area.")


def _check_nearness(plan: RunPlan, robot: Robot) -> None:
    """Refuse a goal that is so many geofences away that its unit is probably wrong, unless a start is given, too."""
    assert plan.goal is not None
    farthest = FAR * robot.limits.geofence
    away = math.hypot(*plan.goal[: robot.state_type.AXES])
    if away >= farthest and not (plan.start or plan.standing):
        raise ConfigError(
            f"the goal lies {away:g} m from the origin, and '{robot.name}' goes at most {robot.limits.geofence:g} m "
            "towards a goal. Give a nearer one, in metres, or say with --start that it begins near this one."
        )


def velocity_target(numbers: Sequence[float], robot: Robot, task: Task) -> np.ndarray:
    """A velocity that was asked for as a target of a task, shape (3,), in space (6,) [m/s, rad/s].

    Raises:
        ConfigError: So many numbers are no velocity of such a robot, the task has no velocities, or the robot is not as
            fast.
    """
    names, given = robot.kind.velocity_form, f"--velocity {written(numbers)}"
    if task.goal_topic != "goal_velocity" or not names:
        usual = robot.kind.velocity_task
        raise ConfigError(
            f"{given}: task '{task.name}' has no velocities{f'. Leave --task out, or use {usual}' if usual else ''}."
        )
    if len(numbers) != len(names):
        raise ConfigError(
            f"{given} has {counted(len(numbers), 'number')}; '{robot.name}' takes {len(names)}: "
            f"{','.join(names)} [m/s, deg/s]."
        )
    size = 3 if task.state_type.AXES == 2 else 6
    held = HeldVelocity((*numbers, *[0.0] * (size - len(numbers))), task.episode_s)
    file = Velocities("velocities", "one velocity", (held,))
    check_pace(file, given, robot, robot.timing.control_hz)
    if not robot.kind.stays:
        find_trim(robot, numbers[0])
    return np.asarray(file.targets()[0])


def _from_file(file: GoalFile, drawn: Goal, start: PoseTuple) -> tuple[Goal, PoseTuple]:
    """The first goal of a file, and a start that suits it."""
    mission = replace(drawn, targets=first_targets(file))
    fixed = start_of(file)
    if fixed is not None:
        return mission, fixed
    axes = file.form.AXES
    way = (mission.current[:axes] - drawn.current[:axes]).tolist()
    return mission, (*(s + w for s, w in zip(start, way, strict=False)), *start[axes:])


def _moved(
    task: Task, mission: Goal, start: PoseTuple, goal: PoseTuple, *, placed: bool
) -> tuple[Goal, PoseTuple]:
    """Put another target into a drawn mission, and move the start along where there are no obstacles or things.

    Of a robot that goes to no places, target and start stay where they are drawn.

    Raises:
        ConfigError: The task has no single target in space.
    """
    if task.goal_topic not in PLACES:
        raise ConfigError(
            f"the targets of task '{task.name}' do not fit into one --goal. Leave it out: --seed draws them"
            f"{VELOCITY if task.goal_topic == 'goal_velocity' else ''}. "
            "Or publish your own while a system runs."
        )
    form, old = task.state_type, mission.current.tolist()
    if not placed:
        goal = (*old[: form.AXES], *goal[form.AXES :])
    if not (mission.obstacles.size or task.things):
        place = (g + s - o for g, s, o in zip(goal[: form.AXES], start, old, strict=False))
        start = (*place, *start[form.AXES :])
    return replace(mission, targets=form.target_at(goal)[None]), start
