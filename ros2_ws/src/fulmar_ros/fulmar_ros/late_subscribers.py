"""Repeats latched messages for volatile subscribers that come late, which the middleware leaves out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy

LOOK_S = 0.5  # a subscriber that was seen at the look before is matched by now


class LateSubscribers:
    """Publishes the current messages of a latched publisher once more when a volatile subscriber has come.

    Nodes that subscribe the topic latched, as ours do, need no repetition and cause none.
    """

    def __init__(self, node: Node, publisher: Publisher, current: Callable[[], Sequence[Any]]) -> None:
        """Look twice a second.

        Args:
            node: Owner of the publisher; its executor looks.
            publisher: Latched.
            current: Messages to repeat, as they were sent, stamps included: subscribers that have them see nothing new.
        """
        self._node, self._publisher, self._current = node, publisher, current
        self._seen: set[bytes] = set()
        self._served: set[bytes] = set()
        node.create_timer(LOOK_S, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _look(self) -> None:
        seen = self._volatile()
        late = (seen & self._seen) - self._served
        self._served = (self._served | late) & seen
        self._seen = seen
        if late:
            for message in self._current():
                self._publisher.publish(message)

    def _volatile(self) -> set[bytes]:
        """Subscriptions of nodes that have no latched one, by their endpoints."""
        latched, volatile = set(), {}
        for info in self._node.get_subscriptions_info_by_topic(self._publisher.topic_name):
            subscriber = (info.node_namespace, info.node_name)
            if info.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL:
                latched.add(subscriber)
            else:
                volatile[bytes(info.endpoint_gid)] = subscriber
        return {endpoint for endpoint, subscriber in volatile.items() if subscriber not in latched}
