"""Stands between who publishes on a wire and who listens, and can spoil what passes."""

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
Spoil = Callable[[Any], Any]  # a message to what is passed on in its place, or to None


def source_of(wire: Wire) -> str:
    """Where messages of a wire come from before they are passed on."""
    return f"unspoiled/{wire.name}"


def unspoiled(message: Any) -> Any:
    """As it came."""
    return message


def lost(_message: Any) -> None:
    """Nothing passes."""


def delayed(periods: int) -> Spoil:
    """Everything comes later, by so many messages."""
    waiting: deque[Any] = deque()

    def spoil(message: Any) -> Any:
        waiting.append(message)
        return waiting.popleft() if len(waiting) > periods else None

    return spoil


class Spoiler:
    """Passes messages on; `spoil` changes each, or swallows it by returning None."""

    def __init__(self, node: Node, wire: Wire) -> None:
        """Begin as if it were not there."""
        self.spoil: Spoil = unspoiled
        kind, reliable = KINDS[wire], wire.delivery != "best_effort"
        self._publisher = node.create_publisher(kind, wire.name, publisher_qos(wire))
        node.create_subscription(
            kind, source_of(wire), self._pass, subscriber_qos(wire, reliable=reliable, depth=10)
        )

    def _pass(self, message: Any) -> None:
        spoilt = self.spoil(message)
        if spoilt is not None:
            self._publisher.publish(spoilt)
