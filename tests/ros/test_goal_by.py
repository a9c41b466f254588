"""The controller's status says which node gave the goal that counts."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from geometry_msgs.msg import PoseStamped
from rclpy.node import Node

from fulmar_core.robots.topics import GOAL_POSE
from fulmar_core.tasks.goal import goal_at
from fulmar_core.wires.operator_action import GOAL
from fulmar_ros.controller_node import ControllerNode
from fulmar_ros.goal_messages import goal_message
from fulmar_ros.operator_actions import OperatorActions
from fulmar_ros.qos import publisher_qos
from tests.ros.neighbour import NAMESPACE, Neighbour, Stream, until

pytestmark = pytest.mark.real_time


def goal_by(neighbour: Neighbour) -> str:
    return neighbour.said["controller"][1].get("goal_by", "?")


class Console:
    """A program of an operator that gives goals, and says so or not."""

    def __init__(self, name: str, by: str = "") -> None:
        self.node = Node(name)
        self.publisher = self.node.create_publisher(
            PoseStamped, f"{NAMESPACE}/{GOAL_POSE.name}", publisher_qos(GOAL_POSE)
        )
        self.actions = OperatorActions(self.node, NAMESPACE, by=by) if by else None

    def give(self, stamp_ns: int) -> None:
        until(lambda: self.publisher.get_subscription_count() > 0)
        if self.actions is not None:
            until(lambda: self.actions.publisher.get_subscription_count() > 0)
            self.actions.say(GOAL, stamp_ns)
        self.publisher.publish(goal_message(goal_at((1.0, 0.0, 0.0)), GOAL_POSE.name, stamp_ns))


@pytest.fixture
def consoles(stream: Stream) -> Iterator[list[Console]]:
    made = [Console("console_1", "alice"), Console("console_2", "bob")]
    yield made
    for console in made:
        console.node.destroy_node()


def test_a_goal_that_no_sender_claims_is_of_the_one_node_that_publishes_goals(
    neighbour: Neighbour, controller: ControllerNode, stream: Stream
) -> None:
    until(lambda: goal_by(neighbour) == f"{NAMESPACE}/neighbour")


def test_of_two_consoles_the_one_is_named_whose_goal_counts(
    neighbour: Neighbour, consoles: list[Console]
) -> None:
    consoles[0].give(11)
    until(lambda: goal_by(neighbour) == "alice")
    consoles[1].give(12)
    until(lambda: goal_by(neighbour) == "bob")
    consoles[0].give(13)
    until(lambda: goal_by(neighbour) == "alice")


def test_two_nodes_that_claim_nothing_are_both_named(neighbour: Neighbour, stream: Stream) -> None:
    stranger = Console("stranger")
    stranger.give(21)
    until(lambda: goal_by(neighbour) == f"one of {NAMESPACE}/neighbour, /stranger")
    stranger.node.destroy_node()
