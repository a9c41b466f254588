"""A hand-made neighbour for one node under test: it publishes by hand, and keeps what it receives."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.context import Context
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool
from visualization_msgs.msg import MarkerArray

from fulmar_core.controllers.controller import Inputs
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import (
    ACTUATORS_STATE,
    AIR_BEARING,
    COMMAND,
    DIAGNOSTICS,
    GOAL_POSE,
    OBSTACLES,
    ODOMETRY,
    VELOCITY_COMMAND,
    Wire,
)
from fulmar_core.tasks.goal import goal_at
from fulmar_ros.convert import OdometryWriter, VectorWriter
from fulmar_ros.goal_messages import goal_message
from fulmar_ros.message_class import message_class
from fulmar_ros.qos import publisher_qos, subscriber_qos
from tests.states import planar_state

ROBOT = "floating_platform"
NAMESPACE = f"/{ROBOT}"
AHEAD = 4.0  # where the neighbour's goals are [m]


class Said(dict[str, tuple[str, dict[str, str]]]):
    """The newest words and values of each node's status; of one that has said nothing yet, nothing."""

    def __missing__(self, node: str) -> tuple[str, dict[str, str]]:
        return "", {}


class Neighbour:
    """Another node: publishes by hand, and keeps what it receives."""

    def __init__(self, robot: str = ROBOT) -> None:
        self.node = Node("neighbour", namespace=f"/{robot}")
        self.robot = load_robot(robot)
        self._goals = 0
        self.applied: list[np.ndarray] = []
        self.commands: list[np.ndarray] = []
        self.said = Said()
        listen, many = self.node.create_subscription, {"reliable": True, "depth": 50}
        listen(
            JointState,
            ACTUATORS_STATE.name,
            self._applied,
            subscriber_qos(ACTUATORS_STATE, **many),
        )
        listen(JointState, COMMAND.name, self._commanded, subscriber_qos(COMMAND, **many))
        listen(
            DiagnosticArray,
            DIAGNOSTICS.name,
            self._receive,
            subscriber_qos(DIAGNOSTICS, **many),
        )
        self._command = self.node.create_publisher(JointState, COMMAND.name, publisher_qos(COMMAND))
        self._odometry = self.node.create_publisher(Odometry, ODOMETRY.name, publisher_qos(ODOMETRY))
        self.goal_publisher = self.node.create_publisher(
            PoseStamped, GOAL_POSE.name, publisher_qos(GOAL_POSE)
        )

        self.bearing = self.node.create_publisher(Bool, AIR_BEARING.name, publisher_qos(AIR_BEARING))
        self.bearing.publish(Bool(data=True))
        self.drive = self.node.create_publisher(
            TwistStamped, VELOCITY_COMMAND.name, publisher_qos(VELOCITY_COMMAND)
        )
        self.mark = self.node.create_publisher(MarkerArray, OBSTACLES.name, publisher_qos(OBSTACLES))

    def _applied(self, message: JointState) -> None:
        self.applied.append(np.array(message.effort))

    def _commanded(self, message: JointState) -> None:
        self.commands.append(np.array(message.effort))

    def _receive(self, message: DiagnosticArray) -> None:
        for status in message.status:
            self.said[status.name.split(": ")[1]] = (
                status.message,
                {pair.key: pair.value for pair in status.values},
            )

    def withdraw_command(self) -> None:
        """Command no more: another node is to."""
        self.node.destroy_publisher(self._command)

    def withdraw_odometry(self) -> None:
        """Measure no more: a plant is to."""
        self.node.destroy_publisher(self._odometry)

    def measure_anew(self) -> None:
        """As a plant that ends in order and starts again."""
        self.withdraw_odometry()
        self._odometry = self.node.create_publisher(Odometry, ODOMETRY.name, publisher_qos(ODOMETRY))

    def command(self, values: list[float], names: list[str] | None = None, stamp_ns: int = 0) -> None:
        """Send one command, an answer to the observation of a stamp or to none."""
        writer = VectorWriter(names or self.robot.actuators.names)
        self._command.publish(writer.write(np.array(values), stamp_ns))

    @staticmethod
    def twist(speed: float, turn_rate: float) -> TwistStamped:
        """A command of wheels."""
        message = TwistStamped()
        message.twist.linear.x, message.twist.angular.z = speed, turn_rate
        return message

    def give_goal(self) -> None:
        """Ask for a pose far away, so that valves open; each time anew."""
        self._goals += 1
        self.repeat_goal()

    def repeat_goal(self) -> None:
        """The newest goal once more, with its stamp."""
        self.goal_publisher.publish(goal_message(goal_at((AHEAD, 0.0, 0.0)), "goal_pose", self._goals))

    def odometry(
        self, stamp_ns: int, spoil: Callable[[Odometry], None] = lambda _message: None, x: float = 0.0
    ) -> None:
        """Send one measurement, spoilt if asked."""
        message = OdometryWriter(self.robot.sensors.odometry).write(planar_state(x, 0.0, 0.0), stamp_ns)
        spoil(message)
        self._odometry.publish(message)


@contextmanager
def second_publisher(domain: int, wire: Wire) -> Iterator[None]:
    """A publisher of the neighbour's name, in another process as far as DDS knows; it need not say a word."""
    context = Context()
    rclpy.init(context=context, domain_id=domain)
    twin = rclpy.create_node("neighbour", namespace=NAMESPACE, context=context)
    twin.create_publisher(message_class(wire), wire.name, publisher_qos(wire))
    yield
    twin.destroy_node()
    rclpy.shutdown(context=context)


def until(condition: Callable[[], bool], timeout_s: float = 8.0) -> None:
    """Wait for something."""
    end = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.01)


def asked_by_neighbour(inputs: Inputs) -> bool:
    """Whether a controller acts on the goal of `Neighbour.give_goal`, and not on that of its warm-up."""
    return bool(inputs.goal.current[0, 0] == AHEAD)


def open_valves(robot: Robot) -> list[float]:
    return [1.0] + [0.0] * (len(robot.actuators.names) - 1)


class Stream:
    """Odometry at 50 Hz from a thread, until reported otherwise."""

    def __init__(self, neighbour: Neighbour) -> None:
        self.neighbour, self.spoil, self.step_ns, self.moving = (
            neighbour,
            lambda _message: None,
            20_000_000,
            True,
        )
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        stamp, count = 1_000_000_000, 0
        while not self._stop.wait(0.02):
            stamp, count = stamp + self.step_ns, count + int(self.moving)
            self.neighbour.odometry(stamp, self.spoil, x=1e-6 * count)

    def stop(self) -> None:
        """Fall silent."""
        self._stop.set()
        self._thread.join()
