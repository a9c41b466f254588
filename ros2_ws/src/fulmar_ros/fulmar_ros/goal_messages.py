"""Goals and obstacles as ROS messages; `message_reader` reads them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from geometry_msgs.msg import PointStamped, PoseArray, PoseStamped, TwistStamped
from nav_msgs.msg import Path
from visualization_msgs.msg import Marker, MarkerArray

from fulmar_core.states.planar import PlanarState
from fulmar_core.states.state import State
from fulmar_core.tasks.goal import Goal
from fulmar_core.wires.robot_name import PLAIN, Frames
from fulmar_ros.convert import stamp_of
from fulmar_ros.marker_messages import marker_of
from fulmar_ros.scene.goal_shapes import obstacle_shapes

GoalMessage: TypeAlias = PointStamped | PoseStamped | Path | PoseArray | TwistStamped
TYPES: dict[str, type] = {
    "goal_point": PointStamped,
    "goal_pose": PoseStamped,
    "goal_path": Path,
    "goal_poses": PoseArray,
    "goal_velocity": TwistStamped,
}


def goal_message(
    goal: Goal, topic: str, time_ns: int, frames: Frames = PLAIN, *, form: type[State] = PlanarState
) -> GoalMessage:
    """A goal as the message of its topic.

    Args:
        goal: Without a batch axis; `goal_path` takes all its targets, any other topic the current one.
        topic: One of `TYPES`.
        time_ns: When it was given; controllers report it back [ns].
        frames: Of the robot.
        form: State type of the task that the goal is for.

    Returns:
        The message, in frame `odom`; velocities in `base_link`.
    """
    if topic == "goal_path":
        path = Path()
        path.header.frame_id, path.header.stamp = frames.odom, stamp_of(time_ns)
        path.poses = [
            _pose(target, time_ns, frames)
            for target in form.rigid_targets(np.asarray(goal.targets), twists=False).tolist()
        ]
        return path
    target = form.rigid_targets(np.asarray(goal.current), twists=topic == "goal_velocity").tolist()
    if topic == "goal_velocity":
        twist = TwistStamped()
        twist.header.frame_id, twist.header.stamp = frames.base, stamp_of(time_ns)
        v, w = twist.twist.linear, twist.twist.angular
        v.x, v.y, v.z, w.x, w.y, w.z = target
        return twist
    if topic == "goal_point":
        point = PointStamped()
        point.header.frame_id, point.header.stamp = frames.odom, stamp_of(time_ns)
        point.point.x, point.point.y, point.point.z = target[:3]
        return point
    return _pose(target, time_ns, frames)


def _pose(target: Sequence[float], time_ns: int, frames: Frames) -> PoseStamped:
    pose = PoseStamped()
    pose.header.frame_id, pose.header.stamp = frames.odom, stamp_of(time_ns)
    p, q = pose.pose.position, pose.pose.orientation
    p.x, p.y, p.z, q.x, q.y, q.z, q.w = target
    return pose


def obstacles_message(obstacles: np.ndarray, time_ns: int, frames: Frames = PLAIN) -> MarkerArray:
    """Discs as cylinders that viewers draw too.

    Args:
        obstacles: Shape (m, 3 or more): x [m], y [m], radius [m]; those of radius 0 are left out.
        time_ns: When they were given; controllers report it back [ns].
        frames: Of the robot.
    """
    # The first marker clears what a viewer drew before, and carries the stamp where there is no obstacle.
    first = Marker(action=Marker.DELETEALL)
    first.header.frame_id, first.header.stamp = frames.odom, stamp_of(time_ns)
    markers = [marker_of(shape, frames) for shape in obstacle_shapes(obstacles)]
    for marker in markers:
        marker.header = first.header
    return MarkerArray(markers=[first, *markers])
