"""Estimates to messages: a row for each wire."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from geometry_msgs.msg import InertiaStamped, TwistWithCovarianceStamped
from nav_msgs.msg import Odometry
from std_msgs.msg import Float64MultiArray, MultiArrayDimension, MultiArrayLayout

from fulmar_core.estimators.motion.estimator import Estimate
from fulmar_core.robots.topics import (
    INERTIA,
    INERTIA_COVARIANCE,
    ODOMETRY,
    RATE,
    Wire,
)
from fulmar_core.states.rotation import rotate_inverse
from fulmar_core.wires.robot_name import Frames
from fulmar_ros.convert import OdometryWriter, stamp_of

Write = Callable[[Estimate], Any]


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


WRITERS: dict[Wire, tuple[type, Callable[[Frames], Write]]] = {
    ODOMETRY: (Odometry, _odometry_writer),
    INERTIA: (InertiaStamped, _inertia_writer),
    INERTIA_COVARIANCE: (Float64MultiArray, _covariance_writer),
    RATE: (TwistWithCovarianceStamped, _rate_writer),
}
