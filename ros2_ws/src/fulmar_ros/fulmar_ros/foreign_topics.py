"""Commands as the nodes of other stacks take them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from geometry_msgs.msg import Twist, TwistStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import Float32MultiArray, Int16MultiArray

DEPTH = 1
RELIABLE = QoSProfile(depth=DEPTH)  # matches subscribers that ask for best effort, too

Send = Callable[[np.ndarray], None]


def velocity_sender(node: Node, topic: str, *, stamped: bool) -> Send:
    """Publishes speed and turn rate as Twist, or as TwistStamped in `base_link`, stamped when it is sent."""
    publisher = node.create_publisher(TwistStamped if stamped else Twist, topic, RELIABLE)

    def send(command: np.ndarray) -> None:
        twist = Twist()
        twist.linear.x, twist.angular.z = float(command[0]), float(command[1])
        if not stamped:
            publisher.publish(twist)
            return
        message = TwistStamped(twist=twist)
        message.header.frame_id = "base_link"
        message.header.stamp = node.get_clock().now().to_msg()
        publisher.publish(message)

    return send


def thrust_sender(node: Node, topic: str) -> Send:
    """Publishes shares of full thrust as Float32MultiArray."""
    publisher = node.create_publisher(Float32MultiArray, topic, RELIABLE)
    return lambda command: publisher.publish(Float32MultiArray(data=[float(share) for share in command]))


def valve_sender(node: Node, topic: str) -> Callable[[Sequence[int]], None]:
    """Publishes zeros and ones as Int16MultiArray."""
    publisher = node.create_publisher(Int16MultiArray, topic, RELIABLE)
    return lambda values: publisher.publish(Int16MultiArray(data=list(values)))
