"""The plant's side of lock step with nodes between plant and controller: what a period holds, and who has answered.

Of the messages that a plant publishes within a control period, readings are counted and kept for a repetition; then one
message says how many each topic has. Odometry goes out once, at the end, since the controller answers each; so does the
truth.
"""

from __future__ import annotations

import struct
import threading
from collections.abc import Iterable
from typing import Any

import numpy as np
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState

from fulmar_bags.message_reader import NS, stamp_ns
from fulmar_core.robots.topics import ANSWER, ODOMETRY, PERIOD
from fulmar_core.wires.lockstep_period import counts_of
from fulmar_ros.bytes_reader import BytesReader
from fulmar_ros.convert import VectorWriter
from fulmar_ros.qos import EVERYTHING, publish_patiently, publisher_qos, subscriber_qos
from fulmar_ros.wire_image import canonical_bytes

STAMP = struct.Struct("<iI")  # seconds and nanoseconds, first in a message with a header
STAMP_AT = 4  # bytes of encapsulation before it; a message of the clock has nothing else


class PlantPeriod:
    """Not thread-safe but for answers, which come under `lock`; the plant's thread alone publishes."""

    def __init__(self, node: Node, chain: Iterable[str], lock: threading.Condition) -> None:
        """Create the endpoints.

        Args:
            node: The plant.
            chain: Names of the nodes between plant and controller.
            lock: Notified of each answer.
        """
        self._chain, self._lock = tuple(chain), lock
        self._odometry_topic = node.resolve_topic_name(ODOMETRY.name)
        self._answered: dict[
            str, tuple[int, int]
        ] = {}  # by node: stamp of the period, and odometry published in it
        self._kept: list[tuple[Publisher, bytes]] = []
        self._counts: dict[str, int] = {}
        self._newest_ns: dict[str, int] = {}  # by topic
        self._topics: dict[Publisher, str] = {}  # asking a publisher takes as long as packing a message
        self._writers: dict[tuple[str, ...], VectorWriter] = {}  # of a period, by its topics
        self.within = (
            False  # whether what is published belongs to a physics step before the last of the period
        )
        self._truth: Publisher | None = None
        self._clock: Publisher | None = None
        self._time = bytearray(serialize_message(Clock())[: STAMP_AT + STAMP.size])  # a message of the clock
        self._at_end_only: set[Publisher] = set()
        self.publisher = node.create_publisher(JointState, PERIOD.name, publisher_qos(PERIOD, lockstep=True))
        every = subscriber_qos(ANSWER, reliable=True, depth=EVERYTHING)
        receive = BytesReader(JointState).passing(self._on_answer)
        self.answers = node.create_subscription(JointState, ANSWER.name, receive, every, raw=True)

    def distinguish(
        self,
        *,
        odometry: Publisher | None,
        truth: Publisher | None,
        clock: Publisher | None,
        counts_truth: bool = False,
    ) -> None:
        """Note which publishers carry no readings of every physics step, and whether the truth counts as a reading."""
        self._truth, self._clock = None if counts_truth else truth, clock
        self._at_end_only = {publisher for publisher in (odometry, truth) if publisher is not None}

    def publish(self, publisher: Publisher, message: Any) -> None:
        """Publish a message or the bytes of one; readings count for the period that is under way."""
        if publisher is self._clock or (publisher in self._at_end_only and self.within):
            return  # the clock is published with the end of a period
        data = canonical_bytes(message)
        publish_patiently(publisher, data)
        if publisher is self._truth:
            return  # only simulated sensors may read it
        self._kept.append((publisher, data))
        topic = self._topics.get(publisher) or self._topics.setdefault(publisher, publisher.topic_name)
        seconds, nanoseconds = STAMP.unpack_from(data, STAMP_AT)
        time_ns = 1_000_000_000 * seconds + nanoseconds
        if time_ns > self._newest_ns.get(topic, -1):  # who counts by stamps leaves repetitions out
            self._newest_ns[topic] = time_ns
            self._counts[topic] = self._counts.get(topic, 0) + 1

    def close(self, time_ns: int) -> None:
        """Publish the clock and what the period holds, which ends at a time [ns]."""
        if self._clock is not None:
            STAMP.pack_into(self._time, STAMP_AT, *divmod(time_ns, NS))
            publish_patiently(self._clock, bytes(self._time))
        topics = tuple(sorted(self._counts))
        if topics not in self._writers:
            self._writers[topics] = VectorWriter(topics, "position")
        data = self._writers[topics].raw(np.array([self._counts[topic] for topic in topics]), time_ns)
        publish_patiently(self.publisher, data)
        self._kept.append((self.publisher, data))

    def repeat(self) -> None:
        """Publish the readings and the end of the period once more: something got lost."""
        for publisher, data in self._kept:
            publish_patiently(publisher, data)

    def begin(self) -> None:
        """Begin the next period."""
        self._kept.clear()
        self._counts.clear()

    def silent(self, time_ns: int) -> list[str]:
        """Nodes that have not answered the period that ends at a time [ns]; call with the lock held."""
        return [name for name in self._chain if self._answered.get(name, (-1, 0))[0] != time_ns]

    def has_odometry(self) -> bool:
        """Whether a node published odometry with its newest answer; call with the lock held."""
        return any(count for _, count in self._answered.values())

    def _on_answer(self, message: JointState) -> None:
        counts = counts_of(message.name, message.position)
        with self._lock:
            self._answered[message.header.frame_id] = (
                stamp_ns(message.header.stamp),
                counts.get(self._odometry_topic, 0),
            )
            self._lock.notify_all()
