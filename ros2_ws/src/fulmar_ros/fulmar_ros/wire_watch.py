"""Looks in the ROS graph for publishers from which a node's subscriptions receive nothing."""

from __future__ import annotations

import time
from collections.abc import Mapping

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy

from fulmar_core.topics import Wire
from fulmar_core.wire_check import Offer, wire_problems

LOOK_S = 2.0  # between two looks; each takes well under a millisecond a topic


class WireWatch:
    """Looks at most every 2 s at the publishers of some wires.

    Attributes:
        problems: Sentences, empty where every publisher fits.
    """

    def __init__(self, node: Node, wires: Mapping[Wire, bool]) -> None:
        """Watch the wires of a node.

        Args:
            node: Whose graph is looked at, and in whose namespace the wires are.
            wires: Wires that it subscribes, and whether reliably.
        """
        self._node = node
        self._wires = {
            wire: (node.resolve_topic_name(wire.name), reliable) for wire, reliable in wires.items()
        }
        self._looked_s = 0.0
        self.problems: list[str] = []

    def look(self) -> list[str]:
        """Look, if the last look is long enough ago; the problems."""
        now_s = time.monotonic()
        if now_s - self._looked_s > LOOK_S:
            self._looked_s = now_s
            self.problems = [
                problem
                for wire, (topic, reliable) in self._wires.items()
                for problem in wire_problems(wire, topic, offers_of(self._node, topic), reliable=reliable)
            ]
        return self.problems


def offers_of(node: Node, topic: str) -> list[Offer]:
    """Publishers of a topic, by its full name, as the graph shows them now."""
    return [
        Offer(
            node=f"{info.node_namespace.rstrip('/')}/{info.node_name}",
            type=info.topic_type,
            reliable=info.qos_profile.reliability != ReliabilityPolicy.BEST_EFFORT,
            latched=info.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL,
        )
        for info in node.get_publishers_info_by_topic(topic)
    ]
