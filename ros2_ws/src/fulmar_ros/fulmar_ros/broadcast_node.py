"""The node `broadcast`: observation and action of a controller as ros2_control's broadcasters publish interfaces.

Names come apart from values, as of its state_interfaces_broadcaster. No other node needs it.
"""

from __future__ import annotations

import os
import sys
import time
from dataclasses import dataclass
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from sensor_msgs.msg import JointState

from fulmar_bags.message_reader import stamp_ns
from fulmar_core.config.yielding import BEHIND
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import ACTION, BROADCAST_NAMES, BROADCAST_VALUES, OBSERVATION
from fulmar_ros.health import Health
from fulmar_ros.message_class import needed_class
from fulmar_ros.operator_subscription import LateSubscribers, subscribe_every
from fulmar_ros.parameters import name_of, read_parameters
from fulmar_ros.qos import publisher_qos
from fulmar_ros.runtime import RequestExit, run_node

HEALTH_S = 1.0
SILENT_S = 2.0  # without a control step: the controller does not act


@dataclass(frozen=True)
class BroadcastSettings:
    """ROS parameters of the node."""

    robot: str = "floating_platform"


class BroadcastNode(Node):
    """Publishes one message of values for each control step, and names where they change."""

    def __init__(self, _request_exit: RequestExit, *, cli_args: list[str] | None = None) -> None:
        """Wait for the controller.

        Args:
            cli_args: ROS arguments of this node alone, where it shares a process.

        Raises:
            FulmarError: If a parameter or a file is wrong, or the messages are not installed.
        """
        super().__init__("broadcast", cli_args=cli_args)
        robot = load_robot(read_parameters(self, BroadcastSettings).robot)
        self._keys: Any = None  # the newest message with names
        self._kinds = needed_class(BROADCAST_NAMES), needed_class(BROADCAST_VALUES)
        self._observed: JointState | None = None
        self._count, self._stepped_s, self._said_s = 0, 0.0, 0.0
        self._names = self.create_publisher(
            self._kinds[0], BROADCAST_NAMES.name, publisher_qos(BROADCAST_NAMES)
        )
        # Viewers ask for volatile messages unless they are configured otherwise, and may start later.
        LateSubscribers(self, self._names, lambda: [self._keys] if self._keys else [])
        self._values = self.create_publisher(
            self._kinds[1], BROADCAST_VALUES.name, publisher_qos(BROADCAST_VALUES)
        )
        self._health = Health(self, f"{name_of(self, robot)}: broadcast")
        subscribe_every(self, JointState, OBSERVATION, self._on_observation)
        subscribe_every(self, JointState, ACTION, self._on_action)
        self.create_timer(HEALTH_S, self._report, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _on_observation(self, message: JointState) -> None:
        self._observed = message

    def _on_action(self, message: JointState) -> None:
        """A control step is complete: its action follows its observation."""
        observed = self._observed
        if observed is None or stamp_ns(observed.header.stamp) != stamp_ns(message.header.stamp):
            return
        names = [
            *(f"observation/{name}" for name in observed.name),
            *(f"action/{name}" for name in message.name),
        ]
        if self._keys is None or list(self._keys.keys) != names:
            self._keys = self._kinds[0](header=message.header, keys=names)
            self._names.publish(self._keys)
        values = [*observed.position, *message.effort]
        self._values.publish(self._kinds[1](header=message.header, values=values))
        self._count += 1
        self._stepped_s = time.monotonic()

    def _report(self) -> None:
        acts = time.monotonic() - self._stepped_s < SILENT_S
        words = "broadcasting" if acts else "the controller publishes no steps"
        self._health.publish("ok", words, {"steps": str(self._count)})


def main() -> None:
    """Broadcast until stopped."""
    os.nice(BEHIND)  # nodes that control come first
    sys.exit(run_node(BroadcastNode))


if __name__ == "__main__":
    main()
