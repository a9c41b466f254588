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
from fulmar_ros.convert import pose_and_twist
from fulmar_ros.wire_image import WireImage, layout_of

Write = Callable[[Estimate], Any]  # to a message, or to the bytes of one


def _rate_writer(frames: Frames) -> Write:
    """Writes a turn rate, shape (3,), with its covariance, shape (3, 3); the velocity is not known."""
    layout = _layout(TwistWithCovarianceStamped(), frames.base)
    unknown = np.diag([-1.0, 0.0, 0.0, 0.0, 0.0, 0.0])

    def write(estimate: Estimate) -> bytes:
        covariance = unknown.copy()
        covariance[3:, 3:] = estimate.covariance
        numbers = (
            0.0,
            0.0,
            0.0,
            *np.asarray(estimate.value, dtype=float).tolist(),
            *covariance.ravel().tolist(),
        )
        return layout.write(estimate.stamp_ns, numbers)

    return write


def _odometry_writer(frames: Frames) -> Write:
    """Writes a `RigidBodyState` with its covariance of shape (12, 12)."""
    layout = _layout(Odometry(child_frame_id=frames.base), frames.odom, frames.base)

    def write(estimate: Estimate) -> bytes:
        pose, twist = pose_and_twist(estimate.value)
        turn = np.eye(6)
        turn[:3, :3] = rotate_inverse(estimate.value.quat_xyzw, np.eye(3)).T  # velocity: world to body
        of_pose, of_twist = estimate.covariance[:6, :6], turn @ estimate.covariance[6:, 6:] @ turn.T
        numbers = (*pose, *of_pose.ravel().tolist(), *twist, *of_twist.ravel().tolist())
        return layout.write(estimate.stamp_ns, numbers)

    return write


def _inertia_writer(frames: Frames) -> Write:
    """Writes an inertia tensor, shape (3, 3)."""
    layout = _layout(InertiaStamped(), frames.base)

    def write(estimate: Estimate) -> bytes:
        xx, xy, xz, _, yy, yz, *_, zz = np.asarray(estimate.value, dtype=float).ravel().tolist()
        mass, com = 0.0, (0.0, 0.0, 0.0)  # are not known
        return layout.write(estimate.stamp_ns, (mass, *com, xx, xy, xz, yy, yz, zz))

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


def _layout(message: Any, frame: str, *texts: str) -> WireImage:
    message.header.frame_id = frame
    return layout_of(message, frame, *texts)


WRITERS: dict[Wire, tuple[type, Callable[[Frames], Write]]] = {
    ODOMETRY: (Odometry, _odometry_writer),
    INERTIA: (InertiaStamped, _inertia_writer),
    INERTIA_COVARIANCE: (Float64MultiArray, _covariance_writer),
    RATE: (TwistWithCovarianceStamped, _rate_writer),
}
