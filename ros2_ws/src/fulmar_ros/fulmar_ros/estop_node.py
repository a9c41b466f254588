"""The node `estop`: the e-stop button of one robot, which reports ten times a second whether it is pressed."""

from __future__ import annotations

import sys
import time
from collections import deque
from dataclasses import dataclass
from typing import Any

from geometry_msgs.msg import TwistStamped
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, String
from std_srvs.srv import Trigger

from fulmar_core.config.process import CONTROL_PRIORITY, take_priority_with_helpers
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import (
    ESTOP,
    ESTOP_RELEASED,
    ESTOP_RESET,
    ESTOP_TRIGGER,
    TELEOP,
    VELOCITY_COMMAND,
    command_wire,
)
from fulmar_core.safety.estop import REPUBLISH_HZ, EstopButton
from fulmar_core.wires import operator_action
from fulmar_ros.health import Health
from fulmar_ros.operator_actions import OperatorActions, who
from fulmar_ros.operator_subscription import subscribe_every
from fulmar_ros.parameters import name_of, read_parameters
from fulmar_ros.qos import LAST_WORDS_S, publisher_qos, subscriber_qos
from fulmar_ros.relay import RelayedInputs
from fulmar_ros.runtime import RequestExit, run_node

OWN_MESSAGES = 50  # of its own e-stop messages, by which the node recognises them: 5 s of them


@dataclass(frozen=True)
class EstopSettings:
    """ROS parameters of the e-stop node."""

    robot: str = "floating_platform"
    pressed: bool = False  # begin pressed: a person then resets it first


class EstopNode(Node):
    """Publishes ten times a second whether the button is pressed; nodes that no longer receive it stop the robot."""

    def __init__(self, _request_exit: RequestExit, *, cli_args: list[str] | None = None) -> None:
        """Begin to publish.

        Args:
            cli_args: ROS arguments of this node alone, where it shares a process.

        Raises:
            FulmarError: If a parameter or the robot's file is wrong.
        """
        super().__init__("estop", cli_args=cli_args)
        settings = read_parameters(self, EstopSettings)
        robot = load_robot(settings.robot)
        self._button = EstopButton()
        self._button.pressed = settings.pressed
        self._reported_s = 0.0
        self._published = 0
        self._own: deque[tuple[int, int, int]] = deque(maxlen=OWN_MESSAGES)  # number, and sent between [ns]
        self._publisher = self.create_publisher(Bool, ESTOP.name, publisher_qos(ESTOP))
        self._released = self.create_publisher(String, ESTOP_RELEASED.name, publisher_qos(ESTOP_RELEASED))
        self._actions = OperatorActions(self, by=f"{who(self)}, by its service")
        self._relayed = RelayedInputs(self)
        pressed = self._relayed.receiver(Bool, ESTOP, self._on_estop)
        subscribe_every(self, Bool, ESTOP, pressed, with_info=True)
        self._health = Health(self, f"{name_of(self, robot)}: estop")
        wire = command_wire(robot)
        if wire is VELOCITY_COMMAND:
            self.create_subscription(TwistStamped, wire.name, self._on_velocity, subscriber_qos(wire))
        else:
            self.create_subscription(
                JointState, wire.name, lambda m: self._on_command(wire.name, m), subscriber_qos(wire)
            )
        self.create_subscription(
            JointState, TELEOP.name, lambda m: self._on_command(TELEOP.name, m), subscriber_qos(TELEOP)
        )
        self.create_service(Trigger, ESTOP_TRIGGER, self._trigger)
        self.create_service(Trigger, ESTOP_RESET, self._reset)
        self._prior = False
        # The first message comes with the first beat: one from here, before the node spins, would be followed by a
        # silence that cancels goals.
        self.create_timer(1.0 / REPUBLISH_HZ, self._beat, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _on_command(self, source: str, message: JointState) -> None:
        zero = not any(message.effort)  # ends at the first value that is not
        self._button.receive_command(source, zero, time.monotonic_ns())

    def _on_velocity(self, message: TwistStamped) -> None:
        zero = message.twist.linear.x == 0.0 and message.twist.angular.z == 0.0
        self._button.receive_command(VELOCITY_COMMAND.name, zero, time.monotonic_ns())

    def _on_estop(self, message: Bool, info: dict[str, Any]) -> None:
        """Latch a press by any other publisher, whose other messages do not count."""
        if not message.data or self._is_own(info) or self._button.pressed:
            return
        self._button.press()
        self._publish()
        self.get_logger().warning(f"e-stop pressed by another publisher of {self._publisher.topic_name}")

    def _is_own(self, info: dict[str, Any]) -> bool:
        number, sent_ns = info["publication_sequence_number"], info["source_timestamp"]
        return any(number == own and begin <= sent_ns <= end for own, begin, end in self._own)

    def _trigger(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        if not self._button.pressed:
            self._actions.say(operator_action.ESTOP)
        self._button.press()
        self._publish()
        self.get_logger().warning("e-stop pressed")
        response.success, response.message = True, "pressed: every actuator goes to its safe state"
        return response

    def _reset(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        problem = self._button.reset(time.monotonic_ns())
        if not problem:
            self._released.publish(String(data=self.get_fully_qualified_name()))
        self._publish()
        self.get_logger().warning(f"e-stop reset {problem}" if problem else "e-stop reset: released")
        response.success = not problem
        response.message = problem or "released: controllers wait for a new goal"
        return response

    def _beat(self) -> None:
        if not self._prior:  # in the executor's thread, which is not there before
            take_priority_with_helpers(CONTROL_PRIORITY)  # its silence stops the robot
            self._prior = True
        self._publish()

    def _publish(self) -> None:
        pressed = self._button.pressed
        self._published += 1
        begin_ns = time.time_ns()
        self._publisher.publish(Bool(data=pressed))
        self._own.append((self._published, begin_ns, time.time_ns()))
        if time.monotonic() - self._reported_s >= 1.0:
            self._reported_s = time.monotonic()
            level, words = ("warn", "pressed") if pressed else ("ok", "released")
            self._health.publish(level, words, {"pressed": str(pressed).lower()})

    def stop(self) -> None:
        """Publish a last press before the process ends; silence would do the same half a second later."""
        self._button.press()
        self._publish()
        self._publisher.wait_for_all_acked(Duration(seconds=LAST_WORDS_S))


def main() -> None:
    """Run the node until it is stopped."""
    sys.exit(run_node(EstopNode))


if __name__ == "__main__":
    main()
