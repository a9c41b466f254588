"""Core types to ROS messages, and serialised messages of the control path to core types.

Messages are filled in place by writers that keep one message each: building an Odometry anew costs more than
everything else a control step does. What a control step publishes is written as bytes, see `wire_image`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState

from fulmar_bags.message_reader import BODY_FRAME, FIRST, FRAME, LAST, NS, lacks_of, measurement_of, stamp_ns
from fulmar_core.robots.sensors.imu import UNKNOWN
from fulmar_core.robots.sensors.odometer import OdometrySpec
from fulmar_core.safety.input_gate import Measurement
from fulmar_core.states.rotation import turned
from fulmar_core.states.state import RigidBodyState
from fulmar_core.wires.robot_name import PLAIN, Frames
from fulmar_ros.wire_image import LATEST_NS, WireImage, layout_of, marks

COVARIANCE = 36  # numbers of the covariance of a pose or a twist


def stamp_of(time_ns: int) -> Time:
    """ROS time of nanoseconds since the epoch; the nearest that a message can hold, since senders may err."""
    time_ns = min(max(time_ns, -LATEST_NS), LATEST_NS - 1)
    return Time(sec=time_ns // NS, nanosec=time_ns % NS)


class OdometryWriter:
    """States as odometry, `odom` → `base_link` where no other frames are given.

    Attributes:
        image: Layout of its messages in bytes.
    """

    def __init__(
        self, spec: OdometrySpec | None, *, frame: str = PLAIN.odom, child_frame: str = PLAIN.base
    ) -> None:
        """Fill in what never changes.

        Args:
            spec: Noise that the covariances state; None for the truth.
            frame: Frame of the pose.
            child_frame: Frame of the twist.
        """
        self._message = Odometry()
        self._message.header.frame_id = frame
        self._message.child_frame_id = child_frame
        if spec is not None:
            place, heading = spec.position.std, spec.heading.std
            self._message.pose.covariance = _diagonal((place, place, 0.0, 0.0, 0.0, heading))
            speed, turn = spec.velocity.std, spec.yaw_rate.std
            self._message.twist.covariance = _diagonal((speed, speed, 0.0, 0.0, 0.0, turn))
        pose, twist = marks(7), marks(6, after=7)
        _fill(self._message, pose, twist)
        self.image = WireImage(self._message, pose, twist, texts=(frame, child_frame))

    def raw(self, state: RigidBodyState, time_ns: int) -> bytes:
        """The message of `write` as bytes."""
        return self.image.write(time_ns, *pose_and_twist(state))

    def write(self, state: RigidBodyState, time_ns: int) -> Odometry:
        """Fill the message; it is overwritten by the next call.

        Args:
            state: Without a batch axis.
            time_ns: Time of measurement [ns].
        """
        self._message.header.stamp = stamp_of(time_ns)
        _fill(self._message, *pose_and_twist(state))
        return self._message


def _fill(message: Odometry, pose: Sequence[float], twist: Sequence[float]) -> None:
    position, q = message.pose.pose.position, message.pose.pose.orientation
    position.x, position.y, position.z, q.x, q.y, q.z, q.w = pose
    v, w = message.twist.twist.linear, message.twist.twist.angular
    v.x, v.y, v.z, w.x, w.y, w.z = twist


def pose_and_twist(state: RigidBodyState) -> tuple[Sequence[float], Sequence[float]]:
    """Place and quaternion in the world, velocity and turn rate in the body."""
    x, y, z, w = state.quat_xyzw.tolist()
    velocity = turned((x, y, z, -w), state.velocity_in_world.tolist())
    pose = (*state.position_in_world.tolist(), x, y, z, w)
    return pose, (*velocity, *state.angular_velocity_in_body.tolist())


class PoseWriter:
    """States as poses of a motion capture."""

    def __init__(self, frames: Frames = PLAIN) -> None:
        """Learn the layout."""
        message = PoseStamped()
        message.header.frame_id = frames.odom
        self._image = layout_of(message, frames.odom)

    def raw(self, state: RigidBodyState, time_ns: int) -> bytes:
        """A message as bytes."""
        return self._image.write(time_ns, (*state.position_in_world.tolist(), *state.quat_xyzw.tolist()))


def _diagonal(stds: Sequence[float]) -> np.ndarray:
    return np.diag(np.square(np.asarray(stds, dtype=float))).ravel()


class VectorWriter:
    """Named vectors as JointState: commands and states in `effort`, observations in `position`.

    Attributes:
        image: Layout of its messages in bytes.
    """

    def __init__(self, names: Sequence[str], field: str = "effort", *, frame: str = "") -> None:
        """Fill in the names.

        Args:
            names: Of the entries, in order.
            field: Which array of the message carries the values.
            frame: Of the header.
        """
        values = marks(len(names))
        self._message = JointState(name=list(names), **{field: values})
        self._message.header.frame_id = frame
        self._field = field
        counts = 1 + ("position", "velocity", "effort").index(field)
        self.image = WireImage(self._message, values, texts=(frame, *names), counts=counts)

    def raw(self, values: np.ndarray, time_ns: int) -> bytes:
        """The message of `write` as bytes; one value for each name."""
        return self.image.write(time_ns, np.asarray(values, dtype=float).tolist())

    def write(self, values: np.ndarray, time_ns: int) -> JointState:
        """Fill the message; it is overwritten by the next call."""
        self._message.header.stamp = stamp_of(time_ns)
        setattr(self._message, self._field, np.asarray(values, dtype=float).tolist())
        return self._message


class TwistWriter:
    """Speed and turn rate as TwistStamped.

    Attributes:
        image: Layout of its messages in bytes.
    """

    def __init__(self, frames: Frames = PLAIN) -> None:
        """Fill in what never changes."""
        self._message = TwistStamped()
        self._message.header.frame_id = frames.base
        v, w = self._message.twist.linear, self._message.twist.angular
        v.x, v.y, v.z, w.x, w.y, w.z = numbers = marks(6)
        self.image = WireImage(self._message, numbers, texts=(frames.base,))
        v.x = v.y = v.z = w.x = w.y = w.z = 0.0

    def raw(self, values: np.ndarray, time_ns: int) -> bytes:
        """The message of `write` as bytes."""
        speed, turn_rate = (float(v) for v in values)
        return self.image.write(time_ns, (speed, 0.0, 0.0, 0.0, 0.0, turn_rate))

    def write(self, values: np.ndarray, time_ns: int) -> TwistStamped:
        """Fill the message with (speed [m/s], turn rate [rad/s]); it is overwritten by the next call."""
        self._message.header.stamp = stamp_of(time_ns)
        self._message.twist.linear.x, self._message.twist.angular.z = (float(v) for v in values)
        return self._message


class OdometryReader:
    """Reads odometry from `odom` to `base_link`, with the prefix of its robot's frames or without."""

    def __init__(self, frames: Frames = PLAIN) -> None:
        """Learn the layout of a robot's own odometry."""
        self._frames = frames
        message = Odometry(child_frame_id=frames.base)
        message.header.frame_id = frames.odom
        pose, twist = marks(7 + COVARIANCE), marks(6 + COVARIANCE, after=7 + COVARIANCE)
        _fill(message, pose[:7], twist[:6])
        message.pose.covariance, message.twist.covariance = np.array(pose[7:]), np.array(twist[6:])
        self._image = WireImage(message, pose, twist, texts=(frames.odom, frames.base))

    def read(self, data: bytes) -> Measurement | None:
        """Read a message, without a check of its content; None for bytes that are no odometry."""
        found = self._image.read(data)
        if found is None:
            message = deserialized(data, Odometry)
            return None if message is None else measurement_of(message, self._frames)
        stamp, (pose, twist) = found
        quat = pose[3:7]
        state = RigidBodyState(
            np.array(pose[:3]), np.array(quat), np.array(turned(quat, twist[:3])), np.array(twist[3:6])
        )
        pose, twist = pose[7:], twist[6:]
        unknown = UNKNOWN in (pose[FIRST], pose[LAST], twist[FIRST], twist[LAST])
        return Measurement(stamp, FRAME, BODY_FRAME, state, lacks_of(pose, twist) if unknown else ())


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
