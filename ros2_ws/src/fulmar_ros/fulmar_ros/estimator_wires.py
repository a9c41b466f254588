"""Messages to readings of estimators, and estimates to messages: a row for each wire that is no sensor's."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from geometry_msgs.msg import InertiaStamped, PoseStamped, TwistWithCovarianceStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Float64MultiArray, MultiArrayDimension, MultiArrayLayout

from fulmar_bags.event_packets import events_of_cloud
from fulmar_bags.message_reader import reading_of, stamp_ns
from fulmar_core.config.errors import shortened
from fulmar_core.estimators.motion.estimator import Estimate
from fulmar_core.robots.sensors.kind import SensorKind
from fulmar_core.robots.sensors.table import SENSORS
from fulmar_core.robots.topics import (
    EVENTS,
    EVENTS_2,
    INERTIA,
    INERTIA_COVARIANCE,
    MOCAP,
    ODOMETRY,
    RATE,
    Wire,
)
from fulmar_core.states.rotation import rotate_inverse
from fulmar_core.wires.reading import Reading
from fulmar_core.wires.robot_name import Frames
from fulmar_ros.convert import OdometryWriter, stamp_of
from fulmar_ros.message_class import message_class

FRAMES = ("odom", "map", "world")  # names of the room in motion captures; all with Z up
Read = Callable[[Any, Frames], Reading | str | None]  # a reading, why there is none, or None without either
Write = Callable[[Estimate], Any]


def _pose(message: PoseStamped, frames: Frames) -> Reading | str:
    frame = frames.plain(message.header.frame_id)
    if frame not in FRAMES:
        return f"pose is in '{shortened(frame)}', must be in one of {', '.join(FRAMES)}"
    p, q = message.pose.position, message.pose.orientation
    return Reading(np.array([p.x, p.y, p.z, q.x, q.y, q.z, q.w]), stamp_ns(message.header.stamp))


def _sensor(kind: SensorKind) -> Read:
    return lambda message, _frames: reading_of(message, kind)


def _rate(message: TwistWithCovarianceStamped, _frames: Frames) -> Reading | str:
    turning = message.twist.twist.angular
    covariance = np.array(message.twist.covariance).reshape(6, 6)[3:, 3:]
    if not (np.isfinite(covariance).all() and np.diag(covariance).min() > 0.0):
        return "rate has a covariance that is not positive"
    return Reading(
        np.array([turning.x, turning.y, turning.z]), stamp_ns(message.header.stamp), covariance=covariance
    )


def _events(message: PointCloud2, _frames: Frames) -> Reading | str:
    events, problem = events_of_cloud(message)
    return problem if events is None else Reading(events, stamp_ns(message.header.stamp))


def _rate_writer(frames: Frames) -> Write:
    """Writes a turn rate, shape (3,), with its covariance, shape (3, 3); the velocity is not known."""

    def write(estimate: Estimate) -> TwistWithCovarianceStamped:
        message = TwistWithCovarianceStamped()
        message.header.stamp, message.header.frame_id = stamp_of(estimate.stamp_ns), frames.base
        turning = message.twist.twist.angular
        turning.x, turning.y, turning.z = (float(part) for part in estimate.value)
        covariance = np.diag([-1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
        covariance[3:, 3:] = estimate.covariance
        message.twist.covariance = covariance.ravel()
        return message

    return write


def _odometry_writer(frames: Frames) -> Write:
    """Writes a `RigidBodyState` with its covariance of shape (12, 12)."""
    writer = OdometryWriter(None, frame=frames.odom, child_frame=frames.base)

    def write(estimate: Estimate) -> Odometry:
        message = writer.write(estimate.value, estimate.stamp_ns)
        message.pose.covariance = estimate.covariance[:6, :6].ravel()
        turn = np.eye(6)
        turn[:3, :3] = rotate_inverse(estimate.value.quat_xyzw, np.eye(3)).T  # velocity: world to body
        message.twist.covariance = (turn @ estimate.covariance[6:, 6:] @ turn.T).ravel()
        return message

    return write


def _inertia_writer(frames: Frames) -> Write:
    """Writes an inertia tensor, shape (3, 3)."""

    def write(estimate: Estimate) -> InertiaStamped:
        message = InertiaStamped()
        message.header.stamp, message.header.frame_id = stamp_of(estimate.stamp_ns), frames.base
        its, tensor = message.inertia, estimate.value
        its.ixx, its.iyy, its.izz = (float(tensor[i, i]) for i in range(3))
        its.ixy, its.ixz, its.iyz = float(tensor[0, 1]), float(tensor[0, 2]), float(tensor[1, 2])
        return message

    return write


def _covariance_writer(_frames: Frames) -> Write:
    """Writes a square covariance by rows."""

    def write(estimate: Estimate) -> Float64MultiArray:
        covariance = np.asarray(estimate.covariance, dtype=float)
        count = len(covariance)
        layout = MultiArrayLayout(
            dim=[
                MultiArrayDimension(label="row", size=count, stride=count * count),
                MultiArrayDimension(label="column", size=count, stride=count),
            ]
        )
        return Float64MultiArray(layout=layout, data=covariance.ravel().tolist())

    return write


READERS: dict[Wire, tuple[type, Read]] = {
    **{
        kind.wire: (message_class(kind.wire), _sensor(kind))
        for kind in SENSORS.values()
        if kind.message is not None
    },
    MOCAP: (PoseStamped, _pose),
    RATE: (TwistWithCovarianceStamped, _rate),
    EVENTS: (PointCloud2, _events),
    EVENTS_2: (PointCloud2, _events),
}
WRITERS: dict[Wire, tuple[type, Callable[[Frames], Write]]] = {
    ODOMETRY: (Odometry, _odometry_writer),
    INERTIA: (InertiaStamped, _inertia_writer),
    INERTIA_COVARIANCE: (Float64MultiArray, _covariance_writer),
    RATE: (TwistWithCovarianceStamped, _rate_writer),
}
