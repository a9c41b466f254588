"""Odometry 200 times and commands 50 times a second, numbered, on the wires of a robot."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Iterator

import rclpy
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState

from fulmar_bringup.run_plan import RunPlan
from fulmar_core.errors import RunFailed
from fulmar_core.process import PLANT_PRIORITY, take_priority
from fulmar_core.robot import Robot, load_robot
from fulmar_core.topics import COMMAND, ODOMETRY
from fulmar_ros.convert import stamp_of
from fulmar_ros.deadline import Deadlines
from fulmar_ros.middleware import set_up_middleware
from fulmar_ros.qos import publisher_qos

ODOMETRY_HZ, EVERY = 200.0, 4  # commands: every fourth
MATCH_TIMEOUT_S = 30.0
SETTLE_S = 0.5  # a publisher sees a match some milliseconds before the subscriber's side is ready


class Traffic:
    """Publishes until it is stopped; the stamp of a message is its number [ns]."""

    def __init__(self, node: Node, robot: Robot) -> None:
        """Make the publishers."""
        self._odometry = node.create_publisher(Odometry, ODOMETRY.name, publisher_qos(ODOMETRY))
        self._command = node.create_publisher(JointState, COMMAND.name, publisher_qos(COMMAND))
        self._names = list(robot.actuators.names)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="traffic", daemon=True)
        self.sent_s: list[float] = []  # monotonic, by number of the odometry message [s]

    def wait_for(self, recorders: int) -> None:
        """Wait until so many recorders listen.

        Raises:
            RunFailed: They do not.
        """
        until = time.monotonic() + MATCH_TIMEOUT_S
        while min(p.get_subscription_count() for p in (self._odometry, self._command)) < recorders:
            if time.monotonic() > until:
                raise RunFailed(f"the recorder has not subscribed within {MATCH_TIMEOUT_S:g} s.")
            time.sleep(0.02)
        time.sleep(SETTLE_S)

    def start(self) -> None:
        """Begin to publish."""
        self._thread.start()

    def stop(self) -> None:
        """Publish no more."""
        self._stop.set()
        self._thread.join()

    def _run(self) -> None:
        take_priority(PLANT_PRIORITY)
        beat, odometry, command = Deadlines(1.0 / ODOMETRY_HZ), Odometry(), JointState(name=self._names)
        command.effort = [0.0] * len(self._names)
        while beat.wait(self._stop):
            number = len(self.sent_s)
            odometry.header.stamp = command.header.stamp = stamp_of(number)
            self._odometry.publish(odometry)
            if number % EVERY == 0:
                self._command.publish(command)
            self.sent_s.append(time.monotonic())


@contextlib.contextmanager
def traffic(plan: RunPlan) -> Iterator[Traffic]:
    """Traffic that has not begun, in the ROS domain of the environment; it ends with the context."""
    set_up_middleware()
    context = rclpy.Context()
    rclpy.init(args=[], context=context, signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("traffic", namespace=plan.namespace, context=context)
    made = Traffic(node, load_robot(plan.robot))
    try:
        yield made
    finally:
        if made._thread.is_alive():
            made.stop()
        node.destroy_node()
        rclpy.shutdown(context=context)
