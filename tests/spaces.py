"""Robots and tasks of the plane and of space in tests, which `state_type` keeps apart."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fulmar_core.loop.teleop import OUT_OF_PLANE
from fulmar_core.robots.actuators.pushing import PLANAR, Pushing
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.state import State
from fulmar_core.tasks import Task, load_task

SPACECRAFT = load_robot("spacecraft_16")
SATELLITE = load_robot("cubesat_wheels")
AIRCRAFT = load_robot("airship_v7")


def shared_space(robots: Mapping[str, Any], tasks: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Names of every robot with every task of the space that it moves in; `Task.check` refuses all other pairs.

    Args:
        robots: By name.
        tasks: Same.
    """
    return [(robot, task) for robot in robots for task in tasks if robots[robot].kind in tasks[task].kinds]


def robot_for(task: Task, in_plane: Robot, in_space: Robot = SPACECRAFT) -> Robot:
    """The one of two robots that moves in the space of a task, a satellite or an aircraft where it is for them."""
    return next(robot for robot in (in_plane, in_space, SATELLITE, AIRCRAFT) if robot.kind in task.kinds)


def task_for(robot: Robot, name: str) -> Task:
    """The task of a name in the space of a robot: those in space end in _3d, and satellites hold an attitude."""
    if robot.actuators.turns_only or robot.flies:
        return load_task("fly_hold" if robot.flies else "point_inertial")
    return load_task(name if robot.state_type is PlanarState else f"{name}_3d")


def at_target(task: Task, target: Any) -> State:
    """Bodies at rest at the first targets of goals, shape (n, k); those that track velocities are at the origin."""
    if task.goal_topic != "goal_velocity":
        return task.state_type.resting(target)
    origin = task.state_type.target_at((0.0,) * task.state_type.AXES)
    return task.state_type.resting(np.broadcast_to(origin, np.shape(target)[:-1] + origin.shape))


def pushes_within_its_plane(robot: Robot) -> bool:
    """Whether a body in space has actuators that move it in the plane of its x and y axes and turn it there."""
    if not isinstance(robot.actuators, Pushing):
        return False
    wrenches = robot.actuators.wrench_per_newton
    within = wrenches[~wrenches[:, OUT_OF_PLANE].any(axis=1)]
    return bool(np.linalg.matrix_rank(within[:, PLANAR]) == len(PLANAR))
