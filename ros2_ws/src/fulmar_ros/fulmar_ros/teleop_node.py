"""The node `teleop`: manual control by keyboard or gamepad, with a dead-man switch.

Nothing is sent before the switch is held for the first time. From then on the person has the robot: let go, and its
actuators go to their safe state; the controller gets it back only when the person says so.
"""

from __future__ import annotations

import math
import os
import select
import sys
import termios
import threading
import time
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.task import Future
from sensor_msgs.msg import JointState, Joy
from std_srvs.srv import Trigger

from fulmar_core.config.errors import DONE, ConfigError
from fulmar_core.loop.teleop import NOTHING, Gamepad, JoyLayout, Keyboard, hand_mapping, keys_help, letting_go
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import GIVE_BACK, JOY, TELEOP
from fulmar_ros.convert import VectorWriter
from fulmar_ros.graph import running_robots_text
from fulmar_ros.parameters import read_parameters
from fulmar_ros.qos import LAST_WORDS_S, SAFE_REPEATS, publisher_qos, subscriber_qos
from fulmar_ros.runtime import RequestExit, run_node

RATE_HZ = 20.0
PATIENCE_S = 3.0  # for a plant that receives the commands, before a warning
ANSWER_S = 2.0  # a plant that does not answer a request by then is asked again


@dataclass(frozen=True)
class TeleopSettings:
    """ROS parameters of the teleoperation node."""

    robot: str = "floating_platform"
    keyboard: bool = True  # read the terminal
    share: float = 0.5  # of what the robot can, at full wish
    ahead_axis: int = 1
    left_axis: int = 0
    turn_axis: int = 3
    deadman_button: int = 4
    give_back_button: int = 5

    def __post_init__(self) -> None:
        """Refuse values without meaning."""
        if not 0.0 < self.share <= 1.0 or not math.isfinite(self.share):
            raise ValueError(f"share = {self.share:g} must be greater than 0 and at most 1.")
        numbers = self.ahead_axis, self.left_axis, self.turn_axis, self.deadman_button, self.give_back_button
        if min(numbers) < 0:
            raise ValueError("axes and buttons count from 0.")

    @property
    def layout(self) -> JoyLayout:
        """Of the gamepad."""
        return JoyLayout(
            self.ahead_axis, self.left_axis, self.turn_axis, self.deadman_button, self.give_back_button
        )


class TeleopNode(Node):
    """Sends a person's commands at a steady beat, for as long as the person has the robot."""

    def __init__(self, request_exit: RequestExit, *, cli_args: list[str] | None = None) -> None:
        """Listen to keys and gamepad.

        Args:
            request_exit: Ends the process.
            cli_args: ROS arguments of this node alone, where it shares a process.

        Raises:
            FulmarError: A parameter is wrong, or there is no terminal to read keys from.
        """
        super().__init__("teleop", cli_args=cli_args)
        settings = read_parameters(self, TeleopSettings)
        robot = load_robot(settings.robot)
        if settings.keyboard and not sys.stdin.isatty():
            raise ConfigError("there is no terminal to read keys from. Use a gamepad: --no-keyboard.")
        self._request_exit, self._share = request_exit, settings.share
        self._binary = robot.actuators.binary
        self._command_for, self._safe = hand_mapping(robot), robot.actuators.safe_command
        self._letting_go = letting_go(robot)
        self._keyboard, self._gamepad = Keyboard(), Gamepad(settings.layout)
        self._lock = threading.Lock()
        self._has_robot, self._over = False, threading.Event()
        self._request: Future | None = None  # to give back, under way
        self._asked_at = 0.0
        self._said = ""
        self._publisher = self.create_publisher(JointState, TELEOP.name, publisher_qos(TELEOP))
        self._writer = VectorWriter(robot.actuators.names)
        self._service = self.create_client(Trigger, GIVE_BACK)
        self.create_subscription(Joy, JOY.name, self._on_joy, subscriber_qos(JOY))
        self.create_timer(1.0 / RATE_HZ, self._send, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._patience = self.create_timer(
            PATIENCE_S, self._look_for_plant, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )
        self._thread: threading.Thread | None = None
        if settings.keyboard:
            self.get_logger().info(keys_help(robot))
            self._thread = threading.Thread(target=self._read_keys, name="keys", daemon=True)
            self._thread.start()

    def _look_for_plant(self) -> None:
        """Warn once if no plant receives the commands."""
        self._patience.cancel()
        if not self._publisher.get_subscription_count():
            self.get_logger().warning(
                f"no plant subscribes {self._publisher.topic_name}. {running_robots_text(self)}"
            )

    def _on_joy(self, message: Joy) -> None:
        with self._lock:
            problem = self._gamepad.see(message.axes, message.buttons, time.monotonic_ns())
            gives_back = self._gamepad.gives_back
        self._say(problem)
        if gives_back:
            self._give_back()

    def _read_keys(self) -> None:
        with _keys_at_once():
            while not self._over.is_set():
                ready, _, _ = select.select([sys.stdin], [], [], 0.1)
                for key in os.read(sys.stdin.fileno(), 64).decode(errors="ignore").lower() if ready else "":
                    self._on_key(key)

    def _on_key(self, key: str) -> None:
        if key == "x":
            self._request_exit(DONE)
        elif key == "g":
            self._give_back()
        with self._lock:
            self._keyboard.press(key, time.monotonic_ns())

    def _send(self) -> None:
        with self._lock:
            now = time.monotonic_ns()
            wish = self._gamepad.wish(now) or self._keyboard.wish(now)
            if wish is not None and not self._has_robot:
                self._has_robot = True
                self._say(f"you have the robot; {self._letting_go}")
            if not self._has_robot or self._over.is_set():
                return
            command = self._command_for(wish or NOTHING)
            if not self._binary:
                command = self._share * command
            self._publisher.publish(self._writer.write(command, 0))

    def _give_back(self) -> None:
        """Ask the plant to listen to the controller again; it refuses while the hand still moves something."""
        if not self._has_robot or (self._request and time.monotonic() - self._asked_at < ANSWER_S):
            return
        if self._request is not None:  # the plant that was asked has died, or hangs
            self._service.remove_pending_request(self._request)
            self._request = None
        if not self._service.service_is_ready():
            self._say(f"nobody takes the robot back: is its plant running? {running_robots_text(self)}")
            return
        self._asked_at = time.monotonic()
        self._request = self._service.call_async(Trigger.Request())
        self._request.add_done_callback(self._on_given_back)

    def _on_given_back(self, future: Future) -> None:
        if future.cancelled():
            return
        self._request = None
        answer = future.result()
        with self._lock:
            self._has_robot = not answer.success
        self._say(answer.message)

    def _say(self, words: str) -> None:
        if words and words != self._said:
            self.get_logger().info(words)
        self._said = words or self._said

    def stop(self) -> None:
        """Publish the safe command several times; it stays in force until a person gives the robot back."""
        self._over.set()
        if self._has_robot:
            for _ in range(SAFE_REPEATS):
                self._publisher.publish(self._writer.write(self._safe, 0))
            self._publisher.wait_for_all_acked(Duration(seconds=LAST_WORDS_S))
        if self._thread is not None:
            self._thread.join(1.0)


@contextmanager
def _keys_at_once() -> Iterator[None]:
    """Give keys as they are pressed, not line by line."""
    before = termios.tcgetattr(sys.stdin)
    tty.setcbreak(sys.stdin)
    try:
        yield
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)


def main() -> None:
    """Run the node until it is stopped."""
    sys.exit(run_node(TeleopNode))


if __name__ == "__main__":
    main()
