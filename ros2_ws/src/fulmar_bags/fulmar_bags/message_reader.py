"""Reads messages into the core's types by the names of their fields alone.

The node gives it messages of ROS, a bag gives it those of `rosbags`: both read the same, and no ROS is needed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from operator import attrgetter
from typing import Any

import numpy as np

from fulmar_core.config.errors import shortened
from fulmar_core.robots.sensors.imu import UNKNOWN
from fulmar_core.robots.sensors.kind import SensorKind
from fulmar_core.safety.input_gate import Measurement
from fulmar_core.states.rotation import turned
from fulmar_core.states.state import RigidBodyState
from fulmar_core.wires.reading import Reading
from fulmar_core.wires.robot_name import PLAIN, Frames

NS = 1_000_000_000
FRAME, BODY_FRAME = PLAIN.odom, PLAIN.base
MOST_WAYPOINTS = 10_000  # more than that is a mistake, and would hold up the control loop
MOST_OBSTACLES = 30  # ways around more would take longer to find than a control step lasts
FIRST, LAST = (
    0,
    35,
)  # entries of a covariance of 6 × 6 that say by -1, as in REP-145, that a part is not known
PARTS_OF_ODOMETRY = ("position", "attitude", "velocity", "turn rate")
ADD = 0  # action of a marker that is there


def stamp_ns(stamp: Any) -> int:
    """Nanoseconds since the epoch of a ROS time."""
    return int(stamp.sec * NS + stamp.nanosec)


def measurement_of(message: Any, frames: Frames = PLAIN) -> Measurement:
    """Read an odometry message; nothing is checked here, but the prefix of its robot's own frames is left out."""
    p, q = message.pose.pose.position, message.pose.pose.orientation
    v, w = message.twist.twist.linear, message.twist.twist.angular
    quat = (q.x, q.y, q.z, q.w)
    state = RigidBodyState(
        np.array([p.x, p.y, p.z]),
        np.array(quat),
        np.array(turned(quat, (v.x, v.y, v.z))),
        np.array([w.x, w.y, w.z]),
    )
    frame, child_frame = (
        shortened(frames.plain(name)) for name in (message.header.frame_id, message.child_frame_id)
    )
    lacks = lacks_of(message.pose.covariance, message.twist.covariance)
    return Measurement(stamp_ns(message.header.stamp), frame, child_frame, state, lacks)


def lacks_of(pose: Sequence[float], twist: Sequence[float]) -> tuple[str, ...]:
    """What a source of odometry does not know, by the covariances of pose and twist, 36 numbers each."""
    if UNKNOWN not in (pose[FIRST], pose[LAST], twist[FIRST], twist[LAST]):
        return ()
    entries = (pose[FIRST], pose[LAST], twist[FIRST], twist[LAST])
    return tuple(part for part, entry in zip(PARTS_OF_ODOMETRY, entries, strict=True) if entry == UNKNOWN)


def reading_of(message: Any, kind: SensorKind) -> Reading:
    """Read a sensor's message by the fields that its row of the table names; its frame is not checked.

    Args:
        message: Of the sensor's wire.
        kind: Row of the sensor; it names fields.
    """
    assert kind.message is not None
    values = [attrgetter(path)(message) for path in kind.message.paths]
    return replace(kind.message.read(values), stamp_ns=stamp_ns(message.header.stamp))


def goal_of(message: Any, frames: Frames = PLAIN) -> tuple[np.ndarray | None, str]:
    """Read the targets of a goal, in six degrees of freedom; `Task.goal_of` makes a goal of them.

    Args:
        message: From any goal topic.
        frames: Of the robot; a message may leave their prefix out.

    Returns:
        Poses in the world, shape (k, 7), or one twist in the body's frame, shape (1, 6), and an empty text; or None and
        what is wrong with the message. A place has no attitude: its quaternion is (0, 0, 0, 1).
    """
    frame = BODY_FRAME if hasattr(message, "twist") else FRAME
    if frames.plain(message.header.frame_id) != frame:
        return None, f"goal frame is '{shortened(message.header.frame_id)}', must be '{frame}'"
    targets: list[tuple[float, ...]] = []
    if hasattr(message, "twist"):
        v, w = message.twist.linear, message.twist.angular
        targets.append((v.x, v.y, v.z, w.x, w.y, w.z))
    elif hasattr(message, "point"):
        targets.append((message.point.x, message.point.y, message.point.z, 0.0, 0.0, 0.0, 1.0))
    else:
        poses = message.poses if hasattr(message, "poses") else [message]
        if not 0 < len(poses) <= MOST_WAYPOINTS:
            return None, f"goal has {len(poses)} waypoints, must have 1 to {MOST_WAYPOINTS}"
        for pose in poses:
            target, problem = _pose(getattr(pose, "pose", pose))  # stamped in a path, not in an array
            if target is None:
                return None, f"goal {problem}"
            targets.append(target)
    if not np.isfinite(targets).all():
        return None, "goal holds a value that is not finite"
    return np.array(targets, dtype=float), ""


def _pose(pose: Any) -> tuple[tuple[float, ...] | None, str]:
    """Place and unit quaternion, seven numbers."""
    p, q = pose.position, pose.orientation
    quat = np.array([q.x, q.y, q.z, q.w])
    if not (np.isfinite(quat).all() and np.isfinite((p.x, p.y, p.z)).all()):
        return None, "holds a value that is not finite"
    norm = math.sqrt(float(quat @ quat))
    if abs(norm - 1.0) > 0.01:
        return None, f"quaternion has norm {norm:.3f}, must be 1"
    return (p.x, p.y, p.z, *(quat / norm).tolist()), ""


def obstacles_of(message: Any, frames: Frames = PLAIN) -> tuple[np.ndarray | None, str]:
    """Read obstacles; arguments as in `goal_of`.

    Returns:
        Discs, shape (m, 3), and an empty text, or None and what is wrong with the message.
    """
    count = len(message.markers)
    if count == MOST_OBSTACLES + 1:  # one of them may clear what a viewer drew before
        count = sum(marker.action == ADD for marker in message.markers)
    if count > MOST_OBSTACLES:
        return None, f"{count} obstacles, at most {MOST_OBSTACLES}"
    discs = []
    for marker in message.markers:
        if frames.plain(marker.header.frame_id) != FRAME:
            return None, f"obstacle frame is '{shortened(marker.header.frame_id)}', must be '{FRAME}'"
        if marker.action == ADD:
            discs.append((marker.pose.position.x, marker.pose.position.y, 0.5 * marker.scale.x))
    found = np.array(discs, dtype=float).reshape(-1, 3)
    if not np.isfinite(found).all() or (found[:, 2] < 0.0).any():
        return None, "an obstacle holds a value that is not finite, or a negative size"
    return found, ""


def thing_of(message: Any, frames: Frames = PLAIN) -> tuple[np.ndarray | None, str]:
    """Pose that a message gives of a thing, shape (7,) as in `goal_of`, or None and why it gives none."""
    if frames.plain(message.header.frame_id) != FRAME:
        return None, f"frame is '{shortened(message.header.frame_id)}', must be '{FRAME}'"
    pose, problem = _pose(message.pose)
    return None if pose is None else np.array(pose), problem
