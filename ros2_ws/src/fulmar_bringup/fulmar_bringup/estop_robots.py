"""Stop and reset robots: on the wire itself, and through their e-stop nodes, so that it lasts."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from geometry_msgs.msg import TwistStamped
from rclpy.client import Client
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.task import Future
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, String
from std_srvs.srv import Trigger

from fulmar_core.robots.topics import (
    COMMAND,
    ESTOP,
    ESTOP_RELEASED,
    ESTOP_RESET,
    ESTOP_TRIGGER,
    TELEOP,
    VELOCITY_COMMAND,
    Wire,
)
from fulmar_core.safety.estop import EstopButton
from fulmar_core.wires import operator_action
from fulmar_core.wires.robot_name import namespace_of
from fulmar_ros.operator_actions import OperatorActions
from fulmar_ros.qos import publisher_qos, subscriber_qos

Answer = tuple[bool, str]  # whether it was done, and the answer of the service
SAY_S = 0.05  # between two messages
STAY_S = 1.0  # at least so long, for robots that are found after the first
MISS_S = 3.0  # for a robot whose e-stop node is not found, or whose topic has no subscriber
ANSWER_S = 2.0  # in which a node must answer
_STOP_LOOK_S, _RESET_LOOK_S = 0.005, 0.05


@dataclass(frozen=True)
class Stopped:
    """Result for one robot."""

    space: str  # its namespace
    reached: bool  # whether a node subscribes its e-stop topic
    answer: Answer | None  # of its e-stop node


def stop_robots(node: Node, robot: str | None, *, find_s: float) -> list[Stopped]:
    """Publish a pressed e-stop for every robot, and ask its e-stop node to publish it from then on.

    A robot is stopped as soon as its plant or its e-stop node is discovered. Meanwhile others are looked for, and its
    node, if that is missing: one that was not asked goes on publishing "released", and its robot would go on.

    Args:
        node: Spins already.
        robot: Only this one; None for all.
        find_s: Longest wait for the first robot [s].

    Returns:
        Every robot that was found, by name.
    """
    began_s = time.monotonic()
    found: dict[str, _Robot] = {}
    said_s = 0.0
    while True:
        now_s = time.monotonic()
        if now_s - said_s > SAY_S:
            said_s = now_s
            for space in _spaces(node, robot) - found.keys():
                found[space] = _Robot(node, space, now_s)
            for one in found.values():
                one.say()
        if found and all(one.is_over(now_s) for one in found.values()):
            return [found[space].stopped() for space in sorted(found)]
        if not found and now_s - began_s > find_s:
            return []
        time.sleep(_STOP_LOOK_S)


class _Robot:
    """One that is being stopped."""

    def __init__(self, node: Node, space: str, found_s: float) -> None:
        self._space, self._found_s = space, found_s
        self._wire: Publisher = node.create_publisher(Bool, f"{space}/{ESTOP.name}", publisher_qos(ESTOP))
        OperatorActions(node, space).say(operator_action.ESTOP)
        self._button: Client = node.create_client(Trigger, f"{space}/{ESTOP_TRIGGER}")
        self._asked: tuple[float, Future] | None = None  # when [s], and what will be answered
        self._reached = False

    def say(self) -> None:
        """Publish once more, and ask the node as soon as it is there."""
        self._wire.publish(Bool(data=True))
        self._reached = self._reached or self._wire.get_subscription_count() > 0
        if self._asked is None and self._button.service_is_ready():
            self._asked = time.monotonic(), self._button.call_async(Trigger.Request())

    def is_over(self, now_s: float) -> bool:
        """Whether there is nothing more to wait for."""
        since_s = now_s - self._found_s
        if self._asked is None or not self._reached:
            return since_s > MISS_S
        asked_s, answer = self._asked
        return since_s > STAY_S and (answer.done() or now_s - asked_s > ANSWER_S)

    def stopped(self) -> Stopped:
        """The result."""
        if self._asked is None or not self._asked[1].done():
            return Stopped(self._space, self._reached, None)
        response = self._asked[1].result()
        return Stopped(self._space, self._reached, (response.success, response.message))


def spaces_with(node: Node, service: str) -> set[str]:
    """Namespaces in which a service is offered or asked for, as far as discovered."""
    end = f"/{service}"
    return {name.removesuffix(end) for name, _ in node.get_service_names_and_types() if name.endswith(end)}


def _spaces(node: Node, robot: str | None) -> set[str]:
    """Namespaces with a plant or an e-stop node, as far as discovered."""
    return _only(spaces_with(node, ESTOP_TRIGGER) | _plants(node), robot)


def _plants(node: Node) -> set[str]:
    return {space for name, space in node.get_node_names_and_namespaces() if name == "plant"}


WATCH_S = 1.0  # commands must be zero, or absent, for about half of it
SETTLE_S = 0.3  # after the first robot was found, for others


def robots_to_reset(node: Node, robot: str | None, *, find_s: float) -> tuple[set[str], set[str]]:
    """Namespaces with an e-stop node, and namespaces with a plant alone.

    The arguments are those of `stop_robots`. A plant counts as alone once no e-stop node was discovered for 3 s.
    """
    began_s = time.monotonic()
    plants: dict[str, float] = {}  # and when they were found [s]
    first_s = float("inf")
    while True:
        now_s = time.monotonic()
        nodes = _only(spaces_with(node, ESTOP_RESET), robot)
        for space in _only(_plants(node), robot):
            plants.setdefault(space, now_s)
        alone = plants.keys() - nodes
        if nodes or plants:
            first_s = min(first_s, now_s)
            settled = robot is not None or now_s - first_s > SETTLE_S
            if settled and all(now_s - plants[space] > MISS_S for space in alone):
                return nodes, alone
        elif now_s - began_s > find_s:
            return set(), set()
        time.sleep(_RESET_LOOK_S)


def release_without_node(node: Node, space: str) -> Answer:
    """Release the e-stop of a robot without e-stop node, by its namespace, if its commands are zero."""
    button = EstopButton()
    button.press()

    def watch(wire: Wire, moves: Callable[[JointState | TwistStamped], bool]) -> None:
        kind = TwistStamped if wire is VELOCITY_COMMAND else JointState
        name = f"{space}/{wire.name}"

        def on_command(message: JointState | TwistStamped) -> None:
            button.receive_command(name, not moves(message), time.monotonic_ns())

        node.create_subscription(kind, name, on_command, subscriber_qos(wire))

    watch(COMMAND, lambda message: any(message.effort))
    watch(TELEOP, lambda message: any(message.effort))
    watch(VELOCITY_COMMAND, lambda m: m.twist.linear.x != 0.0 or m.twist.angular.z != 0.0)
    publisher = node.create_publisher(String, f"{space}/{ESTOP_RELEASED.name}", publisher_qos(ESTOP_RELEASED))
    time.sleep(WATCH_S)
    problem = button.reset(time.monotonic_ns())
    if problem:
        return False, problem
    until = time.monotonic() + ANSWER_S
    while not publisher.get_subscription_count():
        if time.monotonic() > until:
            return False, f"nothing subscribes to {publisher.topic_name}: is its plant running?"
        time.sleep(_RESET_LOOK_S)
    time.sleep(SETTLE_S)  # a match is seen here a moment before the other side is ready
    publisher.publish(String(data=node.get_fully_qualified_name()))
    publisher.wait_for_all_acked(Duration(seconds=ANSWER_S))
    return True, "released on the wire, since it has no e-stop node: controllers wait for a new goal"


def _only(spaces: set[str], robot: str | None) -> set[str]:
    return spaces if robot is None else spaces & {namespace_of(robot)}
