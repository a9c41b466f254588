"""Reads the serialised messages of the control path: their usual layout from the bytes, any other through rclpy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState

from fulmar_bags.message_reader import BODY_FRAME, FRAME, measurement_of, stamp_ns, turned
from fulmar_core.robot_name import PLAIN, Frames
from fulmar_core.safety.input_gate import Measurement
from fulmar_core.state import RigidBodyState
from fulmar_ros.convert import OdometryWriter, TwistWriter, VectorWriter


class OdometryReader:
    """Reads odometry from `odom` to `base_link`, with the prefix of its robot's frames or without."""

    def __init__(self, frames: Frames = PLAIN) -> None:
        """Learn the layout of a robot's own odometry."""
        self._frames = frames
        self._image = OdometryWriter(None, frame=frames.odom, child_frame=frames.base).image

    def read(self, data: bytes) -> Measurement | None:
        """Read a message, without a check of its content; None for bytes that are no odometry."""
        found = self._image.read(data)
        if found is None:
            message = deserialized(data, Odometry)
            return None if message is None else measurement_of(message, self._frames)
        stamp, (pose, twist) = found
        quat = pose[3:]
        state = RigidBodyState(
            np.array(pose[:3]), np.array(quat), np.array(turned(quat, twist[:3])), np.array(twist[3:])
        )
        return Measurement(stamp, FRAME, BODY_FRAME, state)


@dataclass(frozen=True, slots=True)
class NamedVector:
    """Values of actuators without ROS."""

    names: Sequence[str]
    values: Sequence[float]
    stamp_ns: int


class VectorReader:
    """Reads `effort` of a JointState."""

    def __init__(self, names: Sequence[str]) -> None:
        """Learn the layout with these names."""
        self._names, self._image = names, VectorWriter(names).image

    def read(self, data: bytes) -> NamedVector | None:
        """Read a message, whatever its names are; None for bytes that are none."""
        found = self._image.read(data)
        if found is not None:
            stamp, (values,) = found
            return NamedVector(self._names, values, stamp)
        message = deserialized(data, JointState)
        if message is None:
            return None
        return NamedVector(message.name, message.effort, stamp_ns(message.header.stamp))


class TwistReader:
    """Reads speed and turn rate of a TwistStamped."""

    def __init__(self, names: Sequence[str], frames: Frames = PLAIN) -> None:
        """Learn the layout; `names` are those of the actuators."""
        self._names, self._image = names, TwistWriter(frames).image

    def read(self, data: bytes) -> NamedVector | None:
        """Read a message, in whatever frame; None for bytes that are none."""
        found = self._image.read(data)
        if found is not None:
            stamp, (twist,) = found
            return NamedVector(self._names, (twist[0], twist[5]), stamp)
        message = deserialized(data, TwistStamped)
        if message is None:
            return None
        values = (message.twist.linear.x, message.twist.angular.z)
        return NamedVector(self._names, values, stamp_ns(message.header.stamp))


def deserialized(data: bytes, kind: type) -> Any:
    """A message of bytes; None if they are none."""
    try:
        return deserialize_message(data, kind)
    except RuntimeError:  # rclpy's error of this has no public name
        return None
