"""The robot's model and its frames for RViz, Foxglove and tf2; nothing of the control path reads them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from std_msgs.msg import String

from fulmar_core.robots.robot import Robot
from fulmar_core.robots.topics import DESCRIPTION, ORIGIN, STATIC_TRANSFORMS, TRANSFORMS, Wire
from fulmar_core.robots.urdf import body_frames, urdf_of
from fulmar_core.states.state import RigidBodyState
from fulmar_core.wires.robot_name import Frames
from fulmar_ros.message_class import message_class
from fulmar_ros.qos import publisher_qos
from fulmar_ros.wire_image import WireImage, marks

TFMessage: Any = message_class(TRANSFORMS)  # None where tf2_msgs is not installed


class OdometryTransform:
    """Publishes `odom` → `base_link` on /tf; each node that publishes odometry has one."""

    def __init__(
        self,
        node: Node,
        frames: Frames,
        *,
        publish: Callable[[Publisher, Any], None] = Publisher.publish,
        lockstep: bool = False,
    ) -> None:
        """Create the publisher.

        Args:
            node: Its owner.
            frames: Of the robot.
            publish: Publishes a message, or its bytes.
            lockstep: As in `publisher_qos`.
        """
        message = TransformStamped()
        message.header.frame_id, message.child_frame_id = frames.odom, frames.base
        p, q = message.transform.translation, message.transform.rotation
        p.x, p.y, p.z, q.x, q.y, q.z, q.w = numbers = marks(7)
        self._image = WireImage(
            TFMessage(transforms=[message]), numbers, texts=(frames.odom, frames.base), before=1
        )
        self._publish = publish
        self.publisher = node.create_publisher(
            TFMessage, TRANSFORMS.name, publisher_qos(TRANSFORMS, lockstep=lockstep)
        )

    def publish(self, state: RigidBodyState, time_ns: int) -> None:
        """Publish a pose, measured at a time [ns]."""
        self._publish(self.publisher, self.message(state, time_ns))

    def message(self, state: RigidBodyState, time_ns: int) -> bytes:
        """The message that `publish` sends."""
        return self._image.write(time_ns, (*state.position_in_world.tolist(), *state.quat_xyzw.tolist()))


def odometry_transform(
    node: Node, frames: Frames, *, wanted: bool, **options: Any
) -> OdometryTransform | None:
    """One where it is wanted and tf2_msgs is installed; options as in `OdometryTransform`."""
    return OdometryTransform(node, frames, **options) if wanted and TFMessage is not None else None


class ModelWires:
    """`robot_description`, `origin` and /tf_static of one robot, published once and latched."""

    def __init__(
        self,
        node: Node,
        robot: Robot,
        frames: Frames,
        qos: Callable[[Wire], QoSProfile],
        *,
        transforms: bool,
        origin: Sequence[float],
        in_map: bool,
    ) -> None:
        """Publish them.

        Args:
            node: Owner of the publishers.
            robot: The robot.
            frames: Of the robot.
            qos: Quality of service of a wire.
            transforms: Whether /tf_static is published, where tf2_msgs is installed.
            origin: Pose of `odom` in `map`: x, y, z [m], quaternion x, y, z, w.
            in_map: Whether /tf_static says it too; on a real robot another node may know better.
        """
        description = node.create_publisher(String, DESCRIPTION.name, qos(DESCRIPTION))
        description.publish(String(data=urdf_of(robot, frames)))
        x, y, z, *turned = origin
        begins = _fixed("map", frames.odom, (x, y, z), (turned[0], turned[1], turned[2], turned[3]))
        where = node.create_publisher(TransformStamped, ORIGIN.name, qos(ORIGIN))
        where.publish(begins)
        self.publishers = [description, where]
        if transforms and TFMessage is not None:
            fixed = [_fixed(frames.base, frames.named(part.name), part.position, part.quat_xyzw)
                     for part in body_frames(robot)]  # fmt: skip
            if in_map:
                fixed.append(begins)
            static = node.create_publisher(TFMessage, STATIC_TRANSFORMS.name, qos(STATIC_TRANSFORMS))
            static.publish(TFMessage(transforms=fixed))
            self.publishers.append(static)


def pose_of(message: TransformStamped) -> np.ndarray:
    """Pose of a transform's child in its parent: x, y, z [m], quaternion x, y, z, w."""
    t, q = message.transform.translation, message.transform.rotation
    return np.array([t.x, t.y, t.z, q.x, q.y, q.z, q.w], dtype=float)


def _fixed(
    parent: str,
    child: str,
    position: tuple[float, float, float] = (0.0, 0.0, 0.0),
    quat_xyzw: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0),
) -> TransformStamped:
    """A transform that holds at all times, so its stamp is 0."""
    message = TransformStamped()
    message.header.frame_id, message.child_frame_id = parent, child
    p, q = message.transform.translation, message.transform.rotation
    p.x, p.y, p.z = position
    q.x, q.y, q.z, q.w = quat_xyzw
    return message
