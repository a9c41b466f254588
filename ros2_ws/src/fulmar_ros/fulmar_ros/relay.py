"""What an operator sent once, for nodes that its publisher had not found yet.

A publisher may send one message as soon as it has one subscriber, as `ros2 topic pub --once` does. Where that is the
recorder, the message never comes to the controller, which is found a moment later: volatile messages are for those that
are there. So the recorder, the markers and the controller publish the first messages of each publisher once more, on
the wire `relay`, and a node that did not receive a message itself takes it from there.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import Bool, MultiArrayDimension, MultiArrayLayout, UInt8MultiArray

from fulmar_core.robots.topics import ESTOP, GOAL_POSES, GOAL_WIRES, OBSTACLES, RELAY, Wire
from fulmar_ros.operator_subscription import Once, destroy_all, subscribe_every
from fulmar_ros.qos import publisher_qos

PASSED_ON = frozenset((*GOAL_WIRES.values(), GOAL_POSES, OBSTACLES, ESTOP))
GOALS = frozenset(wire.name for wire in (*GOAL_WIRES.values(), GOAL_POSES))  # of which the newest counts
FIRST = 100  # messages of a publisher that are passed on; by then every node has found it
FRESH_NS = (
    1_000_000_000  # what was sent or received longer ago is not passed on: an e-stop may have come since
)
DIGITS = 30  # of a number in a label, at most
HOLD_S = 0.3  # for a message to come by itself; a newer one on its topic takes its place

Receive = Callable[[Any, dict[str, int]], None]  # message and its info


class Relay:
    """Passes on what a node received."""

    def __init__(self, node: Node, space: str = "") -> None:
        """Make the publisher, in the namespace of a robot; empty: the node's own."""
        topic = f"{space}/{RELAY.name}" if space else RELAY.name
        self._publisher = node.create_publisher(UInt8MultiArray, topic, publisher_qos(RELAY))

    def relaying(self, wire: Wire, receive: Receive) -> Receive:
        """A callback that passes messages on, raw or not, after it has called back."""

        def receive_and_relay(message: Any, info: dict[str, int]) -> None:
            receive(message, info)
            self.send(wire, message, info)

        return receive_and_relay if wire in PASSED_ON else receive

    def send(self, wire: Wire, message: Any, info: dict[str, int]) -> None:
        """Pass a message on, if it is one of the first of its publisher; of an e-stop only what presses it."""
        number, sent_ns = info["publication_sequence_number"], info["source_timestamp"]
        # By its sender's clock, too: a latched message may be old when a node begins to listen.
        late = time.time_ns() - min(info["received_timestamp"], sent_ns) > FRESH_NS
        if number > FIRST or not sent_ns or late:
            return
        data = message if isinstance(message, bytes) else serialize_message(message)
        if wire is ESTOP and not deserialize_message(data, Bool).data:
            return
        said = MultiArrayDimension(label=f"{wire.name} {sent_ns} {number}", size=len(data), stride=len(data))
        self._publisher.publish(UInt8MultiArray(layout=MultiArrayLayout(dim=[said]), data=data))

    def destroy(self, node: Node) -> None:
        """Destroy the publisher."""
        node.destroy_publisher(self._publisher)


class RelayedInputs:
    """Takes what others received and this node did not; each message once, whichever way it comes first."""

    def __init__(self, node: Node) -> None:
        """Subscribe; nothing is taken before `receiver` says what."""
        self._inputs: dict[str, tuple[type, Once, bool]] = {}
        # Since when [s], topic, message and its info.
        self._held: list[tuple[float, str, Any, dict[str, int]]] = []
        self._subscriptions = subscribe_every(node, UInt8MultiArray, RELAY, self._on_relayed, depth=FIRST)

    def receiver(self, kind: type, wire: Wire, receive: Receive) -> Receive:
        """A callback for messages that come by themselves, which takes those that only others received.

        An e-stop counts at once; anything else is held until it is clear that it does not come by itself.
        """
        once = Once(receive, with_info=True)
        self._inputs[wire.name] = kind, once, wire is not ESTOP

        def pass_on(message: Any, info: dict[str, int]) -> None:
            same = GOALS if wire.name in GOALS else {wire.name}
            self._held = [each for each in self._held if each[1] not in same]  # they are older than this
            once.pass_on(message, info)

        return pass_on

    def look(self) -> None:
        """Take what was held for long enough; call it several times a second."""
        due = [each for each in self._held if time.monotonic() - each[0] > HOLD_S]
        self._held = self._held[len(due) :]
        for _, topic, message, info in due:
            self._inputs[topic][1].pass_on(message, info)

    def forget(self) -> None:
        """Drop what is held: after an e-stop nothing moves by itself."""
        self._held = []

    def destroy(self, node: Node) -> None:
        """Destroy the subscriptions."""
        destroy_all(node, [self._subscriptions])

    def _on_relayed(self, relayed: UInt8MultiArray) -> None:
        topic, sent_ns, number = _read_label(relayed)
        if topic not in self._inputs:
            return
        kind, once, holds = self._inputs[topic]
        # Without a time of its own, so that it is not passed on once more.
        info = {"source_timestamp": sent_ns, "publication_sequence_number": number, "received_timestamp": 0}
        if once.knows(info):
            return
        try:
            message = deserialize_message(bytes(relayed.data), kind)
        except Exception:  # noqa: BLE001 - whatever rclpy raises for bytes that are no such message
            return
        if holds:
            self._held.append((time.monotonic(), topic, message, info))
        else:
            once.pass_on(message, info)


def _read_label(relayed: UInt8MultiArray) -> tuple[str, int, int]:
    """Topic, source time [ns] and number of a relayed message; an empty topic for what is none."""
    words = relayed.layout.dim[0].label.split(" ") if relayed.layout.dim else []
    if len(words) != 3 or not all(word.isdecimal() and len(word) < DIGITS for word in words[1:]):
        return "", 0, 0
    return words[0], int(words[1]), int(words[2])
