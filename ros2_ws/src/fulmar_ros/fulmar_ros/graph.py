"""Look-ups in the ROS graph: publishers of commands, running robots, and publishers that do not match."""

from __future__ import annotations

import time
from collections.abc import Collection, Iterable, Mapping

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from rclpy.subscription import Subscription
from rclpy.topic_endpoint_info import TopicEndpointInfo

from fulmar_core.robots.topics import Wire
from fulmar_core.robots.wire_check import Offer, wire_problems
from fulmar_core.safety.command_gate import OneWriter

# Of an endpoint's GUID: they name the process, the others the endpoint in it (RTPS 2.5, 9.3.1)
PARTICIPANT_BYTES = 12
UNNAMED_NODE = (
    "_NODE_NAME_UNKNOWN_"  # discovery reports endpoints some moments before the names of their nodes
)
UNNAMED = "a node of unknown name"
ROBOT_NODES = {"plant", "controller"}
NAMING_NS = 1_000_000_000  # in which discovery reports the name of a node whose publisher is known
LOOK_S = 2.0  # between two looks of a watch; each takes well under a millisecond a topic


def full_name(info: TopicEndpointInfo) -> str:
    """Name of an endpoint's node, with its namespace."""
    if info.node_name == UNNAMED_NODE:
        return UNNAMED
    return f"{info.node_namespace.rstrip('/')}/{info.node_name}"


def writers_of(node: Node, subscription: Subscription) -> list[str]:
    """Full names of the nodes that publish to a subscription, sorted; none where there is at most one publisher.

    A node counts once, however many publishers it has; two processes with nodes of one name count twice. A look in the
    graph takes 0.2 ms, so that it is only taken where there is more than one publisher, which takes 1 us to see.
    """
    if subscription.get_publisher_count() < 2:
        return []
    infos = node.get_publishers_info_by_topic(subscription.topic_name)
    processes = {(bytes(info.endpoint_gid[:PARTICIPANT_BYTES]), full_name(info)) for info in infos}
    return sorted(name for _, name in processes)


class WriterWatch:
    """Looks whether more than one node publishes an input that is followed: which of them is right, nobody knows."""

    def __init__(
        self,
        node: Node,
        inputs: Mapping[str, Iterable[Subscription]],
        *,
        restarted: Collection[str] = (),
    ) -> None:
        """Watch inputs.

        Args:
            node: Its owner.
            inputs: Subscriptions of each, by the name that people know it by.
            restarted: Names of those whose node is started anew when it dies. Discovery lists the dead one for some
                seconds more, so that two are a warning and no alarm.
        """
        self._node, self._restarted = node, frozenset(restarted)
        self._inputs = [(name, subscriptions, OneWriter(name)) for name, subscriptions in inputs.items()]
        self._unnamed_since_ns: int | None = None
        self.alarm = self.warning = ""

    def look(self, now_ns: int) -> str:
        """Why no input is followed at a time of a steady clock; empty if all may be; takes 2 us [ns].

        `alarm` has the same words for reports. It waits a second for the name of a node that is not discovered yet.
        `warning` has them, at once, where the input is one of those whose node is started anew.
        """
        reason = self.warning = ""
        for name, subscriptions, writers in self._inputs:
            for subscription in subscriptions:
                writers.see(writers_of(self._node, subscription), now_ns)
            if name in self._restarted:
                self.warning = self.warning or writers.reason(now_ns)
            else:
                reason = reason or writers.reason(now_ns)
        if UNNAMED not in reason:
            self._unnamed_since_ns, self.alarm = None, reason
        elif self._unnamed_since_ns is None:
            self._unnamed_since_ns = now_ns
        elif now_ns - self._unnamed_since_ns > NAMING_NS:
            self.alarm = reason
        return reason or self.warning


class WireWatch:
    """Looks at most every 2 s at the publishers of the wires that a node subscribes."""

    def __init__(self, node: Node, wires: Mapping[Wire, bool]) -> None:
        """Watch wires of a node; the values say whether it receives nothing from a best-effort publisher."""
        self._node = node
        self._wires = {
            wire: (node.resolve_topic_name(wire.name), reliable) for wire, reliable in wires.items()
        }
        self._looked_s = 0.0
        self._problems: list[str] = []

    def look(self) -> list[str]:
        """Publishers from which nothing arrives, one sentence each."""
        now_s = time.monotonic()
        if now_s - self._looked_s > LOOK_S:
            self._looked_s = now_s
            self._problems = [
                problem
                for wire, (topic, reliable) in self._wires.items()
                for problem in wire_problems(wire, topic, offers_of(self._node, topic), reliable=reliable)
            ]
        return self._problems


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


def robot_namespaces(node: Node) -> set[str]:
    """Namespaces with a plant or a controller, as far as they are discovered."""
    return {space for name, space in node.get_node_names_and_namespaces() if name in ROBOT_NODES}


def running_robots_text(node: Node) -> str:
    """A sentence that lists the robots whose nodes are discovered."""
    names = ", ".join(sorted(space.strip("/") for space in robot_namespaces(node) - {"/"}))
    return f"Running robots: {names or 'none'}."
