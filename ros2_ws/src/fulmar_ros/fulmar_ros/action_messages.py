"""Goals, feedback and results of Nav2's actions, from and to what the action node knows of them."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from geometry_msgs.msg import PoseStamped
from rclpy.duration import Duration

from fulmar_bags.message_reader import goal_of
from fulmar_core.config.errors import ConfigError
from fulmar_core.loop.action_end import GOAL_OUTSIDE_MAP, INVALID_PATH, TF_ERROR, UNKNOWN, ActionEnd
from fulmar_core.loop.pursuit import Pursuit
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.geofence import farthest_goal, unreachable
from fulmar_core.safety.input_gate import Measurement
from fulmar_core.tasks import Task
from fulmar_core.wires.origin import in_odom
from fulmar_core.wires.robot_name import Frames
from fulmar_ros.convert import stamp_of

MAP = "map"  # the frame that all robots share
SLOWEST = 0.02  # speed that stands for that of a robot which has not begun to move [m/s]
LONGEST_S = 3600.0  # of a time that is estimated [s]


def execute_goal(handle: Any) -> None:
    """Let a client know that its goal is under way; its result comes by `ActionServer.notify_execute`."""
    event = importlib.import_module("rclpy.action.server").GoalEvent.EXECUTE
    handle._update_state(event)  # `execute` would ask for the result at once


@dataclass(frozen=True)
class Progress:
    """Where the robot is on the way to a goal."""

    measurement: Measurement
    pursuit: Pursuit
    since_s: float  # since the goal came [s]


@dataclass(frozen=True)
class Action:
    """One of Nav2's actions."""

    name: str  # of the server
    message: str  # type in nav2_msgs
    follows: bool = False  # whether its poses are points of a path

    def type(self) -> Any:
        """The class of the action.

        Raises:
            ConfigError: nav2_msgs is not installed.
        """
        try:
            return getattr(importlib.import_module("nav2_msgs.action"), self.message)
        except (ModuleNotFoundError, AttributeError) as error:
            raise ConfigError(
                "action servers need the messages of Nav2, and nav2_msgs is not installed. Run: fulmar install-actions"
            ) from error

    def result(self, end: ActionEnd) -> Any:
        """The result of a goal; Nav2's messages before 1.3.5 have no text."""
        result = self.type().Result(error_code=end.code)
        if hasattr(result, "error_msg"):
            result.error_msg = end.words
        return result

    def feedback(self, progress: Progress, frames: Frames) -> Any:
        """Feedback of a goal."""
        pursuit, feedback = progress.pursuit, self.type().Feedback()
        remaining_m = float(min(pursuit.remaining_m, 1e9))
        if self.follows:
            feedback.distance_to_goal, feedback.speed = remaining_m, pursuit.speed
            return feedback
        feedback.current_pose = _pose(progress.measurement, frames)
        feedback.navigation_time = Duration(seconds=progress.since_s).to_msg()
        left_s = min(remaining_m / max(pursuit.speed, SLOWEST), LONGEST_S)
        feedback.estimated_time_remaining = Duration(seconds=left_s).to_msg()
        feedback.distance_remaining = remaining_m
        if hasattr(feedback, "number_of_poses_remaining"):
            feedback.number_of_poses_remaining = pursuit.left
        return feedback


ACTIONS = (
    Action("navigate_to_pose", "NavigateToPose"),
    Action("navigate_through_poses", "NavigateThroughPoses"),
    Action("follow_path", "FollowPath", follows=True),
)


@dataclass(frozen=True)
class ActionGoal:
    """What a client asks for."""

    targets: np.ndarray  # (k, 7) in `odom`; k = 0 where there is a problem
    problem: ActionEnd | None = None

    @classmethod
    def of(cls, action: Action, request: Any, frames: Frames, origin: np.ndarray | None = None) -> ActionGoal:
        """Read a request.

        Args:
            action: Which one.
            request: Of a client; every pose is in the robot's frame `odom`, or in `map`.
            frames: Of the robot.
            origin: Pose of `odom` in `map`, shape (7,); None: not known.
        """
        if hasattr(request, "path"):
            header, poses = request.path.header, list(request.path.poses)
            for pose in poses:
                pose.header.frame_id = pose.header.frame_id or header.frame_id
        else:
            poses = list(request.poses) if hasattr(request, "poses") else [request.pose]
        if hasattr(poses, "goals"):  # nav_msgs/Goals of releases after Jazzy
            poses = list(poses.goals)
        if not poses:
            return cls(np.zeros((0, 7)), ActionEnd(INVALID_PATH, "the goal has no poses"))
        found = []
        for pose in poses:
            target, problem = _target(pose, frames, origin)
            if target is None:
                code = TF_ERROR if "frame" in problem else INVALID_PATH if action.follows else UNKNOWN
                return cls(np.zeros((0, 7)), ActionEnd(code, problem))
            found.append(target)
        return cls(np.array(found))


def _target(pose: PoseStamped, frames: Frames, origin: np.ndarray | None) -> tuple[np.ndarray | None, str]:
    """A pose in `odom`, shape (7,), and no text; or None and what is wrong with it."""
    if pose.header.frame_id != MAP:
        targets, problem = goal_of(pose, frames)
        return (None if targets is None else targets[0]), problem
    if origin is None:
        return (
            None,
            "goal frame is 'map', and where the robot's 'odom' lies in it is not known: give --origin",
        )
    pose.header.frame_id = frames.odom
    targets, problem = goal_of(pose, frames)
    return (None if targets is None else in_odom(targets[0], origin)), problem


def goal_problem(robot: Robot, task: Task, targets: np.ndarray, area: tuple[float, ...]) -> ActionEnd | None:
    """Why a robot must not go to some poses (k, 7); None where it may.

    Places in the plane have no height.
    """
    goal = task.goal_of(targets)
    problem = task.goal_problem(goal.targets) or unreachable(
        "the goal", goal.targets.tolist(), area, farthest_goal(robot)
    )
    return ActionEnd(GOAL_OUTSIDE_MAP, problem) if problem else None


def _pose(measurement: Measurement, frames: Frames) -> PoseStamped:
    pose, state = PoseStamped(), measurement.state
    pose.header.frame_id, pose.header.stamp = frames.odom, stamp_of(measurement.stamp_ns)
    p, q = pose.pose.position, pose.pose.orientation
    p.x, p.y, p.z = state.position_in_world.tolist()
    q.x, q.y, q.z, q.w = state.quat_xyzw.tolist()
    return pose
