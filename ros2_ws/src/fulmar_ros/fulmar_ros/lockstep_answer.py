"""The side of a node between plant and controller in lock step: collect the readings of a period, then answer it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher
from sensor_msgs.msg import JointState

from fulmar_bags.message_reader import stamp_ns
from fulmar_core.robots.topics import ANSWER, PERIOD
from fulmar_core.wires.lockstep_period import PLANT, PeriodInbox, counts_of
from fulmar_ros.convert import stamp_of
from fulmar_ros.qos import EVERYTHING, publish_patiently, publisher_qos, subscriber_qos
from fulmar_ros.wire_image import canonical_bytes

Compute = Callable[[int, list[tuple[str, Any]]], list[tuple[Publisher, Any]]]


class LockstepAnswer:
    """Calls a function with the readings of each period, publishes what it returns, and answers the plant."""

    def __init__(
        self,
        node: Node,
        topics: Mapping[str, str],
        compute: Compute,
        outputs: Iterable[Publisher],
        *,
        upstream: Iterable[str] = (),
        wait_for_subscribers: int = 0,
    ) -> None:
        """Create the endpoints; last, after every other subscription, so that a plant that sees these has all.

        Args:
            node: Owner of the endpoints.
            topics: Name of the reading by the full name of its topic.
            compute: Called with the stamp of a period [ns] and its readings by time and name; returns publishers
                with what they are to publish.
            outputs: Publishers of the node.
            upstream: Other nodes between plant and this one.
            wait_for_subscribers: Of each output; before they are there the plant is not answered, and asks again.
        """
        self._compute, self._outputs, self._awaited = compute, tuple(outputs), wait_for_subscribers
        self._inbox: PeriodInbox[Any] = PeriodInbox(topics, upstream=upstream)
        self._name = node.get_name()
        self._sent: list[tuple[Publisher, Any]] = []
        self._answers = node.create_publisher(JointState, ANSWER.name, publisher_qos(ANSWER, lockstep=True))
        if upstream:
            every = subscriber_qos(ANSWER, reliable=True, depth=EVERYTHING)
            node.create_subscription(JointState, ANSWER.name, self._on_answer, every)
        every = subscriber_qos(PERIOD, reliable=True, depth=EVERYTHING)
        node.create_subscription(JointState, PERIOD.name, self._on_period, every)

    def add(self, topic: str, time_ns: int, item: Any) -> None:
        """Take a reading that came on a topic with a stamp [ns]."""
        self._inbox.add(topic, time_ns, item)
        self._answer()

    def _on_period(self, message: JointState) -> None:
        if stamp_ns(message.header.stamp) == self._inbox.answered_ns:
            self._publish()  # the answer got lost
            return
        self._expect(PLANT, message)

    def _on_answer(self, message: JointState) -> None:
        self._expect(message.header.frame_id, message)

    def _expect(self, source: str, message: JointState) -> None:
        counts = counts_of(message.name, message.position)
        self._inbox.expect(source, stamp_ns(message.header.stamp), counts)
        self._answer()

    def _answer(self) -> None:
        if any(output.get_subscription_count() < self._awaited for output in self._outputs):
            return
        period = self._inbox.take()
        if period is not None:
            stamp, readings = period
            self._sent = [
                (publisher, canonical_bytes(it)) for publisher, it in self._compute(stamp, readings)
            ]
            topics = [publisher.topic_name for publisher in self._outputs]
            sent = [publisher.topic_name for publisher, _ in self._sent]
            answer = JointState(name=topics, position=[float(sent.count(topic)) for topic in topics])
            answer.header.stamp, answer.header.frame_id = stamp_of(stamp), self._name
            self._sent.append((self._answers, answer))
            self._publish()

    def _publish(self) -> None:
        for publisher, message in self._sent:
            publish_patiently(publisher, message)
