"""Reset the e-stop of robots: through their e-stop nodes, and on the wire where a robot has none."""

from __future__ import annotations

import time
from collections.abc import Callable

from geometry_msgs.msg import TwistStamped
from rclpy.duration import Duration
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from fulmar_bringup.stop_robots import ANSWER_S, MISS_S, Answer, spaces_with
from fulmar_core.robot_name import namespace_of
from fulmar_core.safety.estop import EstopButton
from fulmar_core.topics import COMMAND, ESTOP_RELEASED, ESTOP_RESET, TELEOP, VELOCITY_COMMAND, Wire
from fulmar_ros.qos import publisher_qos, subscriber_qos

WATCH_S = 1.0  # commands must be zero, or absent, for about half of it
SETTLE_S = 0.3  # after the first robot was found, for others
_BEAT_S = 0.05


def robots_to_reset(node: Node, robot: str | None, *, find_s: float) -> tuple[set[str], set[str]]:
    """Namespaces with an e-stop node, and namespaces with a plant alone.

    Args:
        node: Spins already.
        robot: Only this one; None for all.
        find_s: Longest wait for the first robot [s].

    Returns:
        With a node, and without; a plant counts as without a node once none was seen for 3 s.
    """
    began_s = time.monotonic()
    plants: dict[str, float] = {}  # and when they were found [s]
    first_s = float("inf")
    while True:
        now_s = time.monotonic()
        nodes = _only(spaces_with(node, ESTOP_RESET), robot)
        seen = {space for name, space in node.get_node_names_and_namespaces() if name == "plant"}
        for space in _only(seen, robot):
            plants.setdefault(space, now_s)
        alone = plants.keys() - nodes
        if nodes or plants:
            first_s = min(first_s, now_s)
            settled = robot is not None or now_s - first_s > SETTLE_S
            if settled and all(now_s - plants[space] > MISS_S for space in alone):
                return nodes, alone
        elif now_s - began_s > find_s:
            return set(), set()
        time.sleep(_BEAT_S)


def release_without_node(node: Node, space: str) -> Answer:
    """Release the e-stop of a robot that has no e-stop node, if its commands are zero.

    Args:
        node: Spins already.
        space: Namespace of the robot.

    Returns:
        Whether it is released, and why not.
    """
    button = EstopButton()
    button.press()

    def watch(wire: Wire, moves: Callable[[JointState | TwistStamped], bool]) -> None:
        kind = TwistStamped if wire is VELOCITY_COMMAND else JointState
        name = f"{space}/{wire.name}"
        node.create_subscription(
            kind,
            name,
            lambda message: button.receive_command(name, not moves(message), time.monotonic_ns()),
            subscriber_qos(wire),
        )

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
        time.sleep(_BEAT_S)
    time.sleep(SETTLE_S)  # a match is seen here a moment before the other side is ready
    publisher.publish(String(data=node.get_fully_qualified_name()))
    publisher.wait_for_all_acked(Duration(seconds=ANSWER_S))
    return True, "released on the wire, since it has no e-stop node: controllers wait for a new goal"


def _only(spaces: set[str], robot: str | None) -> set[str]:
    return spaces if robot is None else spaces & {namespace_of(robot)}
