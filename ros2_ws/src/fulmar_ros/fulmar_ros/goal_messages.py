"""Goals and obstacles between the core's types and ROS messages."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from geometry_msgs.msg import PointStamped, PoseStamped, TwistStamped
from nav_msgs.msg import Path
from visualization_msgs.msg import Marker, MarkerArray

from fulmar_core.goal import Goal, goal_at
from fulmar_core.rotation import from_yaw, yaw_of
from fulmar_ros.convert import stamp_of

GoalMessage = PointStamped | PoseStamped | Path | TwistStamped
TYPES: dict[str, type] = {
    "goal_point": PointStamped,
    "goal_pose": PoseStamped,
    "goal_path": Path,
    "goal_velocity": TwistStamped,
}
MOST_WAYPOINTS = 10_000  # more than that is a mistake, and would hold up the control loop
MOST_OBSTACLES = 30  # ways around more would take longer to find than a control step lasts
FRAME, BODY_FRAME = "odom", "base_link"


def goal_message(goal: Goal, topic: str, time_ns: int) -> GoalMessage:
    """A goal as the message of its topic.

    Args:
        goal: Without a batch axis; `goal_path` takes all its targets, any other topic the current one.
        topic: One of `TYPES`.
        time_ns: When it was given; controllers report it back [ns].

    Returns:
        The message, in frame `odom`; velocities in `base_link`.
    """
    if topic == "goal_path":
        path = Path()
        path.header.frame_id, path.header.stamp = FRAME, stamp_of(time_ns)
        path.poses = [_pose(target, time_ns) for target in np.asarray(goal.targets)]
        return path
    target = np.asarray(goal.current)
    if topic == "goal_velocity":
        twist = TwistStamped()
        twist.header.frame_id, twist.header.stamp = BODY_FRAME, stamp_of(time_ns)
        twist.twist.linear.x, twist.twist.linear.y = float(target[0]), float(target[1])
        twist.twist.angular.z = float(target[2])
        return twist
    if topic == "goal_point":
        point = PointStamped()
        point.header.frame_id, point.header.stamp = FRAME, stamp_of(time_ns)
        point.point.x, point.point.y = float(target[0]), float(target[1])
        return point
    return _pose(target, time_ns)


def _pose(target: np.ndarray, time_ns: int) -> PoseStamped:
    pose = PoseStamped()
    pose.header.frame_id, pose.header.stamp = FRAME, stamp_of(time_ns)
    pose.pose.position.x, pose.pose.position.y = float(target[0]), float(target[1])
    q = pose.pose.orientation
    q.x, q.y, q.z, q.w = from_yaw(np.asarray(target[2])).tolist()
    return pose


def goal_of(message: Any) -> tuple[Goal | None, str]:
    """Read a goal.

    Args:
        message: From any goal topic.

    Returns:
        The goal without a batch axis and an empty text, or None and what is wrong with the message.
    """
    frame = BODY_FRAME if isinstance(message, TwistStamped) else FRAME
    if message.header.frame_id != frame:
        return None, f"goal frame is '{message.header.frame_id}', must be '{frame}'"
    if isinstance(message, TwistStamped):
        targets = [(message.twist.linear.x, message.twist.linear.y, message.twist.angular.z)]
    elif isinstance(message, PointStamped):
        targets = [(message.point.x, message.point.y, 0.0)]
    else:
        poses = message.poses if isinstance(message, Path) else [message]
        if not 0 < len(poses) <= MOST_WAYPOINTS:
            return None, f"goal has {len(poses)} waypoints, must have 1 to {MOST_WAYPOINTS}"
        targets = []
        for pose in poses:
            target, problem = _target(pose)
            if target is None:
                return None, problem
            targets.append(target)
    if not np.isfinite(targets).all():
        return None, "goal holds a value that is not finite"
    return goal_at(*targets), ""


def _target(message: PoseStamped) -> tuple[tuple[float, float, float] | None, str]:
    p, q = message.pose.position, message.pose.orientation
    quat = np.array([q.x, q.y, q.z, q.w])
    if not (np.isfinite(quat).all() and np.isfinite((p.x, p.y, p.z)).all()):
        return None, "goal holds a value that is not finite"
    norm = math.sqrt(float(quat @ quat))
    if abs(norm - 1.0) > 0.01:
        return None, f"goal quaternion has norm {norm:.3f}, must be 1"
    return (p.x, p.y, float(yaw_of(quat / norm))), ""


def obstacles_message(obstacles: np.ndarray, time_ns: int) -> MarkerArray:
    """Discs as cylinders that viewers draw too.

    Args:
        obstacles: Shape (m, 3 or more): x [m], y [m], radius [m]; those of radius 0 are left out.
        time_ns: When they were given; controllers report it back [ns].
    """
    there = [disc[:3] for disc in np.asarray(obstacles) if disc[2] > 0.0]
    # The first marker clears what a viewer drew before, and carries the stamp where there is no obstacle.
    first = Marker(action=Marker.DELETEALL)
    first.header.frame_id, first.header.stamp = FRAME, stamp_of(time_ns)
    markers = [first]
    for number, (x, y, radius) in enumerate(there):
        marker = Marker(ns="obstacles", id=number, type=Marker.CYLINDER, action=Marker.ADD)
        marker.header = first.header
        marker.pose.position.x, marker.pose.position.y, marker.pose.position.z = float(x), float(y), 0.25
        marker.pose.orientation.w = 1.0
        marker.scale.x = marker.scale.y = 2.0 * float(radius)
        marker.scale.z = 0.5
        marker.color.r, marker.color.g, marker.color.b, marker.color.a = 0.8, 0.3, 0.2, 1.0
        markers.append(marker)
    return MarkerArray(markers=markers)


def obstacles_of(message: MarkerArray) -> tuple[np.ndarray | None, str]:
    """Read obstacles.

    Returns:
        Discs, shape (m, 3), and an empty text, or None and what is wrong with the message.
    """
    if len(message.markers) > MOST_OBSTACLES:
        return None, f"{len(message.markers)} obstacles, at most {MOST_OBSTACLES}"
    discs = []
    for marker in message.markers:
        if marker.header.frame_id != FRAME:
            return None, f"obstacle frame is '{marker.header.frame_id}', must be '{FRAME}'"
        if marker.action == Marker.ADD:
            discs.append((marker.pose.position.x, marker.pose.position.y, 0.5 * marker.scale.x))
    found = np.array(discs, dtype=float).reshape(-1, 3)
    if not np.isfinite(found).all() or (found[:, 2] < 0.0).any():
        return None, "an obstacle holds a value that is not finite, or a negative size"
    return found, ""
