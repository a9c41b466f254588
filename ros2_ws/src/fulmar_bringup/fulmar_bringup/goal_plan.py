"""Checks, start, duration and shown path of a run, as its goal file asks for."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from fulmar_bringup.task_choice import task_of_goals
from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.geofence import check_places, farthest_goal
from fulmar_core.states.attitude import angle_between
from fulmar_core.states.spatial import quat_of
from fulmar_core.tasks import Task, load_task
from fulmar_core.tasks.goal import PoseTuple
from fulmar_core.tasks.goal_files import (
    FollowedPath,
    GoalFile,
    Poses,
    Positions,
    Trajectory,
    Velocities,
    goal_file_path,
    load_goals,
)
from fulmar_core.tasks.goal_numbers import check_place
from fulmar_core.tasks.goal_sequence import goal_sequence

GOALS_HZ = 10.0  # of a goal node, at most
TRIED = 720  # places along a path where a step is measured
SHOWN = 400  # points of a path that a record carries along
SPARE_S = 5.0  # after everything is done, to see that it stays so


def goal_path(goals: str) -> Path:
    """Where a goal file lies, in full."""
    return goal_file_path(goals).absolute()


def is_path_of_places(task: Task) -> bool:
    """Whether a task takes all places at once."""
    return task.goal_topic == "goal_path"


def checked_goals(goals: str, robot: Robot, task: Task, goal_hz: float) -> GoalFile:
    """A goal file that a task's controller can follow in a run, with goals that come so often [Hz].

    Raises:
        ConfigError: Unknown name, a mistake in the file, a task that takes other goals, or a robot that cannot.
    """
    file = load_goals(goals)
    as_path = is_path_of_places(task) and isinstance(file, Positions | Poses)
    fits = goal_sequence(file, robot, as_path=as_path).topic == task.goal_topic
    turns = task.tolerance.heading_deg + task.tolerance.attitude_deg
    fits &= task.state_type is file.form and not (isinstance(file, Positions) and turns > 0.0)
    if not fits or task.sees_obstacles or task.things:  # whose surroundings the seed draws
        raise ConfigError(
            f"the goals '{goals}' are no goals of task '{task.name}'. "
            f"Leave --task out: they are for '{task_of_goals(goals)}'."
        )
    check_pace(file, goals, robot, goal_hz)
    return file


def goal_rate(control_hz: float, *, lockstep: bool = False) -> float:
    """How often a target that moves is another goal: as often as commands, but for a goal node by the clock [Hz]."""
    return control_hz if lockstep else min(control_hz, GOALS_HZ)


def check_pace(file: GoalFile, goals: str, robot: Robot, goal_hz: float) -> None:
    """Refuse velocities that the robot cannot reach, and targets whose every goal begins anew.

    Args:
        file: The goals.
        goals: What they are called.
        robot: Whose goals they are.
        goal_hz: How often a goal comes, of a target that moves; see `goal_rate` [Hz].

    Raises:
        ConfigError: They are beyond its top speed or turn rate, or sideways or on the spot where it cannot go so; or a
            target moves or turns by more than its task's tolerance from one goal to the next.
    """
    if isinstance(file, FollowedPath):
        ahead, sideways = file.speed, 0.0
    elif isinstance(file, Trajectory):
        ahead, sideways = file.speed, 0.0
        _check_step(file, goals, goal_hz)
        _check_motion(file, goals, robot)
    elif isinstance(file, Velocities):
        targets = file.targets()
        axes = file.form.AXES
        _check_turning(targets[:, axes:], targets[:, 0], goals, robot)
        ahead = float(np.linalg.norm(targets[:, :axes], axis=1).max())
        sideways = float(np.abs(targets[:, 1]).max())
    else:
        return
    can = robot.performance
    if sideways > 0.0 and can.lateral_speed == 0.0:
        raise ConfigError(
            f"the goals '{goals}' ask for {sideways:g} m/s sideways; '{robot.name}' cannot go sideways."
        )
    if ahead > can.top_speed:
        raise ConfigError(
            f"the goals '{goals}' ask for {ahead:g} m/s; '{robot.name}' goes at most {can.top_speed:g} m/s."
        )


def _check_step(file: Trajectory, goals: str, goal_hz: float) -> None:
    """Refuse a target that is another goal at each step: it moves or turns beyond the tolerance of its task."""
    tolerance = load_task(task_of_goals(goals)).tolerance
    most = tolerance.position * goal_hz
    if file.speed > most:
        raise ConfigError(
            f"the goals '{goals}' move by {file.speed:g} m/s, at {goal_hz:g} Hz by more than the task's tolerance in a "
            f"control step: at most {most:g} m/s."
        )
    if not tolerance.attitude_deg:
        return
    turned = _largest_turn_deg(file, 1.0 / goal_hz)
    if turned > tolerance.attitude_deg:
        raise ConfigError(
            f"the goals '{goals}' turn by up to {turned:.1f} deg in a control step at {goal_hz:g} Hz, and the task's "
            f"tolerance is {tolerance.attitude_deg:g} deg. Give a lower speed than {file.speed:g} m/s, a wider path, "
            "or 'facing: fixed'."
        )


def _check_motion(file: Trajectory, goals: str, robot: Robot) -> None:
    """Refuse a target that is faster than tasks of the robot ask for, or bends harder than it can follow."""
    can, target = robot.performance, file.target()
    if file.speed > can.speed:
        raise ConfigError(
            f"the goals '{goals}' move by {file.speed:g} m/s, and tasks of '{robot.name}' ask for "
            f"{can.speed:g} m/s at most: it would fall behind. Give a lower speed."
        )
    needs = target.acceleration()
    if needs > can.turning_acceleration:
        slower = file.speed * math.sqrt(can.turning_acceleration / needs)
        raise ConfigError(
            f"the goals '{goals}' bend so hard that {file.speed:g} m/s takes {needs:.3g} m/s², and '{robot.name}' "
            f"sustains {can.turning_acceleration:g} m/s². Give a speed of {slower:.2g} m/s at most, or wider bends."
        )
    if file.facing in ("fixed", "any"):
        return
    step_s = robot.timing.control_s
    rate = math.radians(_largest_turn_deg(file, step_s)) / step_s
    if rate > can.yaw_rate:
        raise ConfigError(
            f"the goals '{goals}' turn by {math.degrees(rate):.3g} deg/s, and tasks of '{robot.name}' ask for "
            f"{math.degrees(can.yaw_rate):.3g} deg/s at most. Give a lower speed, wider bends, or 'facing: fixed'."
        )


def _largest_turn_deg(file: Trajectory, step_s: float) -> float:
    """Largest angle between two poses of a target that lie a step apart, anywhere along its path [deg]."""
    target = file.target()
    times = np.linspace(0.0, target.round_s, TRIED)
    before, after = (np.stack([target.pose(t + late) for t in times]) for late in (0.0, step_s))
    return math.degrees(float(np.max(angle_between(quat_of(before), quat_of(after)))))


def _check_turning(turns: np.ndarray, ahead: np.ndarray, goals: str, robot: Robot) -> None:
    """The same of turn rates, shape (n, 1 or 3) [rad/s], at speeds ahead, shape (n,) [m/s]."""
    most = robot.actuators.largest_yaw_rate or robot.limits.yaw_rate
    asked = float(np.linalg.norm(turns, axis=1).max())
    if asked > most:
        raise ConfigError(
            f"the goals '{goals}' ask for {math.degrees(asked):g} deg/s; '{robot.name}' turns with at most "
            f"{math.degrees(most):.1f} deg/s."
        )
    curvature = robot.actuators.largest_curvature
    if curvature is not None:
        tightest = np.abs(turns[:, 0]) - curvature * np.abs(ahead)
        if tightest.max() > 1e-9:
            worst = int(np.argmax(tightest))
            speed, rate = float(ahead[worst]), float(turns[worst, 0])
            raise ConfigError(
                f"the goals '{goals}' ask for {math.degrees(rate):g} deg/s at {speed:g} m/s; '{robot.name}' turns in "
                f"no circle of less than {1.0 / curvature:.2f} m."
            )


def first_targets(file: GoalFile) -> np.ndarray:
    """Targets that the file begins with, as in `fulmar_core.tasks.goal.Goal`."""
    return np.zeros((1, 3)) if isinstance(file, FollowedPath) else file.targets()


def check_file_places(file: GoalFile, goals: str, robot: Robot, area: Sequence[float]) -> None:
    """Reject goals, of a file of some name or of `--pose`, that lie where a robot must not go.

    Raises:
        ConfigError: As in `geofence.check_places`, or a pose has a place and the robot goes to none.
    """
    what = f"the goal of '{goals}'" if goals else "the goal"
    for pose in file.poses if isinstance(file, Poses) else ():
        check_place(pose, robot, what)
    check_places(what, _places_of(file).tolist(), area, farthest_goal(robot))


def _places_of(file: GoalFile) -> np.ndarray:
    """Where a file leads, as `geofence.unreachable` takes it; no place for velocities."""
    if isinstance(file, FollowedPath):
        return np.asarray(file.planner().points)
    if isinstance(file, Trajectory):
        points = file.target().points
        return np.column_stack((points, np.zeros((len(points), 4))))  # as poses
    return np.zeros((0, 3)) if isinstance(file, Velocities) else file.targets()


def start_of(file: GoalFile) -> PoseTuple | None:
    """Start of a run; None for places: the start that the seed draws around the first of them."""
    if isinstance(file, FollowedPath):
        (x, y), (next_x, next_y) = file.planner().points[:2].tolist()
        return x, y, math.degrees(math.atan2(next_y - y, next_x - x))
    if isinstance(file, Trajectory):
        return file.form.written(file.targets()[0])
    return (0.0,) * len(file.form.NUMBERS) if isinstance(file, Velocities) else None


def duration_of(file: GoalFile, robot: Robot, start: PoseTuple) -> float:
    """How long a robot needs, with time to spare; for endless rounds, that of one [s]."""
    if isinstance(file, Velocities):
        return float(file.ends()[-1]) + SPARE_S
    if isinstance(file, FollowedPath):
        planner = replace(file, loops=max(1, file.loops)).planner()
        length = planner.spacing * len(planner.points) * (planner.loops if planner.closed else 1)
        return 1.25 * length / file.speed + SPARE_S
    if isinstance(file, Trajectory):
        return replace(file, loops=max(1, file.loops)).target().duration_s + 2.0 * SPARE_S  # it stops at once
    axes, can = file.form.AXES, robot.performance
    if not robot.kind.goes_anywhere:
        attitudes = np.concatenate((file.form.target_at(start)[None], file.targets()))[:, axes:]
        turns = [angle_between(tuple(q), tuple(after)) for q, after in itertools.pairwise(attitudes)]
        return float(np.sum(20.0 + 3.0 * np.array(turns) / can.yaw_rate)) + SPARE_S
    places = np.concatenate((np.array([start[:axes]]), file.targets()[:, :axes]))
    ways = np.linalg.norm(np.diff(places, axis=0), axis=1)
    return float(np.sum(20.0 + 3.0 * ways / can.speed)) + SPARE_S


def shown_path(file: GoalFile) -> list[list[float]]:
    """Where a path runs that is followed, thinned out [m]; empty for goals of another kind."""
    if isinstance(file, Trajectory):
        points = file.target().points
        return np.round(points[:: max(1, len(points) // SHOWN)], 4).tolist()
    if not isinstance(file, FollowedPath):
        return []
    planner = file.planner()
    points = planner.points[:: max(1, len(planner.points) // SHOWN)]
    ends = points[:1] if planner.closed else planner.points[-1:]
    return np.round(np.concatenate((points, ends)), 4).tolist()


def is_endless(file: GoalFile) -> bool:
    """Whether the goals never come to an end."""
    if isinstance(file, Trajectory):
        return file.path.closed and file.loops == 0
    return isinstance(file, FollowedPath) and file.planner().closed and file.loops == 0
