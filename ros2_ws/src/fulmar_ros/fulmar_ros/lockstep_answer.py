"""The side of a node between plant and controller in lock step: collect the readings of a period, then answer it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
from rclpy.node import Node
from rclpy.publisher import Publisher
from sensor_msgs.msg import JointState

from fulmar_bags.message_reader import stamp_ns
from fulmar_core.robots.topics import ANSWER, PERIOD
from fulmar_core.wires.lockstep_period import PLANT, PeriodInbox, counts_of
from fulmar_ros.bytes_reader import BytesReader
from fulmar_ros.convert import VectorWriter, stamp_of
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
        take: Callable[[str, Any], object] | None = None,
        upstream: Iterable[str] = (),
        silent: Iterable[str] = (),
        wait_for_subscribers: int = 0,
    ) -> None:
        """Create the endpoints; last, after every other subscription, so that a plant that sees these has all.

        Args:
            node: Owner of the endpoints.
            topics: Name of the reading by the full name of its topic.
            compute: Called with the stamp of a period [ns] and its readings by time and name; returns publishers
                with what they are to publish.
            outputs: Publishers of the node.
            take: Called with the name of a reading and the reading as soon as none that goes before it can come; the
                rest of a period goes to `compute`. None: all of it does.
            upstream: Other nodes between plant and this one.
            silent: As in `PeriodInbox`.
            wait_for_subscribers: Of each output; before they are there the plant is not answered, and asks again.
        """
        self._compute, self._outputs, self._awaited = compute, tuple(outputs), wait_for_subscribers
        self._take = take
        self._topics = [publisher.topic_name for publisher in self._outputs]
        self._inbox: PeriodInbox[Any] = PeriodInbox(topics, upstream=upstream, silent=silent)
        self._name = node.get_name()
        self._sent: list[tuple[Publisher, Any]] = []
        self._answers = node.create_publisher(JointState, ANSWER.name, publisher_qos(ANSWER, lockstep=True))
        self._write_answer = (
            VectorWriter(self._topics, "position", frame=self._name) if self._topics else None
        )
        if upstream:
            every = subscriber_qos(ANSWER, reliable=True, depth=EVERYTHING)
            receive = BytesReader(JointState).passing(self._on_answer)
            node.create_subscription(JointState, ANSWER.name, receive, every, raw=True)
        every = subscriber_qos(PERIOD, reliable=True, depth=EVERYTHING)
        receive = BytesReader(JointState).passing(self._on_period)
        node.create_subscription(JointState, PERIOD.name, receive, every, raw=True)

    def add(self, topic: str, time_ns: int, item: Any) -> None:
        """Take a reading that came on a topic with a stamp [ns]."""
        self._inbox.add(topic, time_ns, item)
        if self._take is not None:
            for name, reading in self._inbox.ready():
                self._take(name, reading)
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
        if not self._inbox.is_asked or (
            self._awaited and any(each.get_subscription_count() < self._awaited for each in self._outputs)
        ):
            return
        period = self._inbox.take()
        if period is not None:
            stamp, readings = period
            self._sent = [
                (publisher, canonical_bytes(it)) for publisher, it in self._compute(stamp, readings)
            ]
            self._sent.append((self._answers, self._answer_to(stamp)))
            self._publish()

    def _answer_to(self, time_ns: int) -> Any:
        """Says how many messages of each topic belong to a period [ns]."""
        if self._write_answer is None:
            answer = JointState()
            answer.header.stamp, answer.header.frame_id = stamp_of(time_ns), self._name
            return answer
        sent = [publisher.topic_name for publisher, _ in self._sent]
        return self._write_answer.raw(np.array([sent.count(topic) for topic in self._topics]), time_ns)

    def _publish(self) -> None:
        for publisher, message in self._sent:
            publish_patiently(publisher, message)
