"""Commands as the nodes of other stacks take them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from geometry_msgs.msg import Twist, TwistStamped
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from std_msgs.msg import ByteMultiArray, Float32MultiArray, Int16MultiArray, UInt8MultiArray

DEPTH = 1
RELIABLE = QoSProfile(depth=DEPTH)  # matches subscribers that ask for best effort, too

# Arrays of zeros and ones for valves, by the names that hardware files use.
VALVE_MESSAGES: dict[str, type] = {
    "int16": Int16MultiArray,
    "byte": ByteMultiArray,
    "uint8": UInt8MultiArray,
}
Send = Callable[[np.ndarray], None]


def velocity_sender(node: Node, topic: str, *, stamped: bool, frame: str) -> tuple[Send, Publisher]:
    """What publishes speed and turn rate as Twist, or as TwistStamped in a frame, and its publisher."""
    publisher = node.create_publisher(TwistStamped if stamped else Twist, topic, RELIABLE)

    def send(command: np.ndarray) -> None:
        twist = Twist()
        twist.linear.x, twist.angular.z = float(command[0]), float(command[1])
        if not stamped:
            publisher.publish(twist)
            return
        message = TwistStamped(twist=twist)
        message.header.frame_id = frame
        message.header.stamp = node.get_clock().now().to_msg()
        publisher.publish(message)

    return send, publisher


def thrust_sender(node: Node, topic: str) -> tuple[Send, Publisher]:
    """What publishes shares of full thrust as Float32MultiArray, and its publisher."""
    publisher = node.create_publisher(Float32MultiArray, topic, RELIABLE)

    def send(command: np.ndarray) -> None:
        publisher.publish(Float32MultiArray(data=[float(share) for share in command]))

    return send, publisher


def valve_sender(
    node: Node, topic: str, message: str = "int16"
) -> tuple[Callable[[Sequence[int]], None], Publisher]:
    """What publishes zeros and ones as a message of `VALVE_MESSAGES`, and its publisher."""
    kind = VALVE_MESSAGES[message]
    publisher = node.create_publisher(kind, topic, RELIABLE)
    if kind is ByteMultiArray:
        return lambda values: publisher.publish(kind(data=[bytes([value]) for value in values])), publisher
    return lambda values: publisher.publish(kind(data=list(values))), publisher


def valve_values(message: Any) -> list[int]:
    """The numbers in a message of `VALVE_MESSAGES`; rclpy gives each byte of a ByteMultiArray as `bytes`."""
    return [value[0] if isinstance(value, bytes) else int(value) for value in message.data]
