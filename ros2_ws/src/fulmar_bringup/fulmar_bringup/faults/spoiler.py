"""Stands between who measures and who controls, and can spoil what passes."""

from __future__ import annotations

from collections.abc import Callable

from nav_msgs.msg import Odometry
from rclpy.node import Node

from fulmar_core.topics import ODOMETRY
from fulmar_ros.qos import publisher_qos, subscriber_qos

MEASURED = "measured/odom"  # where the odometry comes from before it is passed on
Spoil = Callable[[Odometry], Odometry | None]


def unspoiled(message: Odometry) -> Odometry:
    """As it came."""
    return message


class Spoiler:
    """Passes odometry on; `spoil` changes each message, or swallows it by returning None."""

    def __init__(self, node: Node) -> None:
        """Begin as if it were not there."""
        self.spoil: Spoil = unspoiled
        self._publisher = node.create_publisher(Odometry, ODOMETRY.name, publisher_qos(ODOMETRY))
        node.create_subscription(
            Odometry, MEASURED, self._pass, subscriber_qos(ODOMETRY, reliable=True, depth=10)
        )

    def _pass(self, message: Odometry) -> None:
        spoilt = self.spoil(message)
        if spoilt is not None:
            self._publisher.publish(spoilt)
