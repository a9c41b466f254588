"""Tasks: goals, observations, rewards and errors.

The explicit table of tasks. A new task is one file here, one line below and one YAML; a user's own is a class outside.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, cast

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.own_class import is_own
from fulmar_core.config.paths import config_path
from fulmar_core.config.plausibility import check_plausible
from fulmar_core.config.plausible_ranges import TASK
from fulmar_core.config.strict_yaml import load_config
from fulmar_core.robots.kinds.free_flyer import FREE_FLYER
from fulmar_core.tasks.dock import Dock
from fulmar_core.tasks.follow_pose_3d import FollowPose3d
from fulmar_core.tasks.follow_reference import FollowReference
from fulmar_core.tasks.go_to_pose import GoToPose
from fulmar_core.tasks.go_to_pose_3d import GoToPose3d
from fulmar_core.tasks.go_to_position import GoToPosition
from fulmar_core.tasks.go_to_position_3d import GoToPosition3d
from fulmar_core.tasks.go_to_position_with_obstacles import GoToPositionWithObstacles
from fulmar_core.tasks.hold_flight import HoldAirspeed, HoldAttitude
from fulmar_core.tasks.inspect import Inspect
from fulmar_core.tasks.own_task import load_own_task
from fulmar_core.tasks.point import Point
from fulmar_core.tasks.push_block import PushBlock
from fulmar_core.tasks.race_gates import RaceGates
from fulmar_core.tasks.task import Task
from fulmar_core.tasks.track_velocities import TrackVelocities
from fulmar_core.tasks.track_velocities_3d import TrackVelocities3d
from fulmar_core.tasks.waypoint_tasks import GoThroughPoses, GoThroughPositions, RaceWaypoints, RaceWayposes
from fulmar_core.tasks.waypoints_3d import GoThroughPoses3d, GoThroughPositions3d

__all__ = ["ShippedTask", "Task", "load_recorded_task", "load_task"]

ShippedTask = (  # what a file of `configs/tasks` can be
    GoToPose
    | GoToPosition
    | GoToPositionWithObstacles
    | GoThroughPositions
    | GoThroughPoses
    | TrackVelocities
    | RaceWaypoints
    | RaceWayposes
    | RaceGates
    | PushBlock
    | GoToPosition3d
    | GoToPose3d
    | TrackVelocities3d
    | GoThroughPositions3d
    | GoThroughPoses3d
    | FollowPose3d
    | Inspect
    | Dock
    | Point
    | FollowReference
    | HoldAttitude
    | HoldAirspeed
)
_asked_for: set[str] = set()  # dotted paths that this process was given, in the place of what a bag names


def load_task(name: str, thing: str = "") -> Task:
    """Load a task by a name that `fulmar list tasks` shows, or by the dotted path of a user's own class.

    Args:
        name: Of the task.
        thing: Of `configs/things`, in the place of that of the task; empty: that of the task, if it has any.

    Raises:
        ConfigError: Unknown name, a mistake in the file, a class as in `load_own_task`, or a thing in space in the
            world of a robot that does not fly there.
    """
    if is_own(name):
        task = load_own_task(name)
        _asked_for.add(name)
        return _among(task, thing)
    path = config_path("tasks", name)
    shipped = cast(ShippedTask, load_config(ShippedTask, path))  # type: ignore[arg-type]
    if shipped.name != name:
        raise ConfigError(
            f"{path}: 'name' is '{shipped.name}', the file's own name is '{name}'. Make them equal."
        )
    check_plausible(shipped, TASK, path)
    return _among(shipped, thing)


def _among(task: Task, thing: str) -> Task:
    """A task with a thing in space in its world; the thing's file is read, so that its mistakes come first."""
    if thing and is_own(task.name):
        raise ConfigError(
            f"task '{task.name}' is a class of your own, which takes no thing in space. Leave it out."
        )
    if thing and task.keeps_thing and thing != task.thing:
        raise ConfigError(
            f"task '{task.name}' has a berth at '{task.thing}', not at '{thing}'. Leave --thing out, or write a task "
            "with a berth there."
        )
    among = cast(Task, replace(cast(Any, task), thing=thing)) if thing else task  # all others are dataclasses
    if among.structures and FREE_FLYER not in task.kinds:
        raise ConfigError(
            f"'{among.thing}' stands in space, and task '{task.name}' is for robots that do not fly there. Leave "
            f"--thing out, or choose a task of free flyers, such as {FREE_FLYER.usual_task}."
        )
    return among


def load_recorded_task(name: str, bag: Path, thing: str = "") -> Task:
    """Load the task that a bag names, as `load_task` does, without importing a class that only the bag names.

    Raises:
        ConfigError: As in `load_task`; or a class that this process has not loaded by `load_task` before.
    """
    if is_own(name) and name not in _asked_for:  # a bag from elsewhere must not have its code run
        raise ConfigError(
            f"{bag}: the task is '{name}', a class that only this bag names. To use it: --task {name}."
        )
    return load_task(name, thing)
