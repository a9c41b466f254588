"""Stands between who publishes on a wire and who listens, and can change what passes."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import PoseStamped, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from sensor_msgs.msg import JointState

from fulmar_core.topics import COMMAND, MOCAP, ODOMETRY, VELOCITY_COMMAND, Wire
from fulmar_ros.qos import publisher_qos, subscriber_qos

KINDS = {ODOMETRY: Odometry, MOCAP: PoseStamped, COMMAND: JointState, VELOCITY_COMMAND: TwistStamped}
Injection = Callable[[Any], Any]  # a message to what is passed on in its place, or to None


def source_of(wire: Wire) -> str:
    """Where messages of a wire come from before they are passed on."""
    return f"original/{wire.name}"


def unchanged(message: Any) -> Any:
    """As it came."""
    return message


def lost(_message: Any) -> None:
    """Nothing passes."""


def delayed(periods: int) -> Injection:
    """Everything comes later, by so many messages."""
    waiting: deque[Any] = deque()

    def change(message: Any) -> Any:
        waiting.append(message)
        return waiting.popleft() if len(waiting) > periods else None

    return change


class FaultInjector:
    """Passes messages on; `change` changes each, or swallows it by returning None."""

    def __init__(self, node: Node, wire: Wire) -> None:
        """Begin as if it were not there."""
        self.change: Injection = unchanged
        kind, reliable = KINDS[wire], wire.delivery != "best_effort"
        self._publisher = node.create_publisher(kind, wire.name, publisher_qos(wire))
        node.create_subscription(
            kind, source_of(wire), self._pass, subscriber_qos(wire, reliable=reliable, depth=10)
        )

    def _pass(self, message: Any) -> None:
        changed = self.change(message)
        if changed is not None:
            self._publisher.publish(changed)
