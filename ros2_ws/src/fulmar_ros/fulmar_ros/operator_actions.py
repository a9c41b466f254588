"""Who acts: programs of operators say it beside what they do, and nodes look in the graph for those that do not."""

from __future__ import annotations

import socket
from collections.abc import Collection

from rclpy.node import Node
from std_msgs.msg import String

from fulmar_core.robots.topics import OPERATOR_ACTION
from fulmar_core.wires.operator_action import OperatorAction
from fulmar_ros.graph import UNNAMED, full_name
from fulmar_ros.qos import publisher_qos


def who(node: Node) -> str:
    """Full name of a node and its host."""
    return f"{node.get_fully_qualified_name()} on {socket.gethostname()}"


class OperatorActions:
    """Says who presses an e-stop or gives a goal; say it before the message that it is about."""

    def __init__(self, node: Node, space: str = "", *, by: str = "") -> None:
        """Make the publisher.

        Args:
            node: Its owner.
            space: Namespace of the robot; empty: the node's own.
            by: Who acts; empty: the node and its host.
        """
        self._by = by or who(node)
        name = f"{space}/{OPERATOR_ACTION.name}" if space else OPERATOR_ACTION.name
        self.publisher = node.create_publisher(String, name, publisher_qos(OPERATOR_ACTION))

    def say(self, does: str, stamp_ns: int = 0, *, by: str = "") -> None:
        """Say that this operator presses the e-stop, or gives the goal of a stamp [ns].

        `by` names who of those does it who act through this node.
        """
        who_does = f"{by} of {self._by}" if by else self._by
        self.publisher.publish(String(data=OperatorAction(who_does, does, stamp_ns).to_text()))


def publishers_of(
    node: Node, topics: Collection[str], *, but: Collection[str] = ()
) -> tuple[list[str], bool]:
    """Full names of the nodes that publish one of some topics, sorted, and whether all names are known by now.

    Args:
        node: Whose graph is asked.
        topics: Relative or absolute names.
        but: Full names that are left out.
    """
    infos = [
        info for topic in topics for info in node.get_publishers_info_by_topic(node.resolve_topic_name(topic))
    ]
    names = {full_name(info) for info in infos} - set(but)
    return sorted(names), UNNAMED not in names
