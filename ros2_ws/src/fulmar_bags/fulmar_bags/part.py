"""One MCAP file of a bag, which says by itself what made it and what its messages mean. Knows no rclpy."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import yaml
from mcap.data_stream import RecordBuilder
from mcap.records import Channel, Schema
from mcap.well_known import MessageEncoding, Profile, SchemaEncoding

from fulmar_bags.mcap_file import BagFile, mcap_writer
from fulmar_bags.message_types import MessageType, offered_qos
from fulmar_bags.metadata import BagSpan
from fulmar_core.topics import Delivery

CHUNK_BYTES = 1 << 20


@dataclass
class Topic:
    """One topic of a bag and how many of its messages the bag was given."""

    name: str
    type: MessageType
    delivery: Delivery
    messages: int = 0


class BagPart:
    """One file, from its creation to its index."""

    def __init__(self, path: Path) -> None:
        """Create the file, without content.

        Args:
            path: Must not exist yet.

        Raises:
            OSError: It exists, or cannot be created.
        """
        self.name = path.name
        self._file = BagFile(path)
        self._mcap = mcap_writer(self._file, chunk_size=CHUNK_BYTES)
        self._mcap.start(profile=Profile.ROS2, library="fulmar")
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._messages = self._first_ns = self._last_ns = 0

    @property
    def span(self) -> BagSpan:
        """What this file was given."""
        return BagSpan(self._messages, self._first_ns, self._last_ns)

    @property
    def size(self) -> int:
        """Bytes on disk."""
        return self._file.size

    @property
    def waiting(self) -> int:
        """Bytes that the disk has not taken yet, without the chunk in progress."""
        return self._file.waiting

    def begin(
        self,
        records: Mapping[str, Mapping[str, str]],
        attachments: Mapping[str, bytes],
        topics: Iterable[Topic],
    ) -> None:
        """Say what made the bag.

        Args:
            records: Metadata records by name.
            attachments: Files by name.
            topics: What was announced before this file was begun.
        """
        for name, record in records.items():
            self.add_record(name, record)
        for name, data in attachments.items():
            self.attach(name, data)
        for topic in topics:
            self.add_topic(topic)

    def attach(self, name: str, data: bytes) -> None:
        """Carry a file along."""
        now = time.time_ns()
        self._mcap.add_attachment(now, now, name, "application/octet-stream", data)

    def add_record(self, name: str, record: Mapping[str, str]) -> None:
        """Add a metadata record."""
        self._mcap.add_metadata(name, dict(record))

    def add_topic(self, topic: Topic) -> None:
        """Announce a topic; its definition reaches the disk with the next flush, also without a message."""
        kind, definition = topic.type, topic.type.definition.encode()
        builder = RecordBuilder()
        if kind.name not in self._schemas:
            number = self._mcap.register_schema(kind.name, SchemaEncoding.ROS2, definition)
            self._schemas[kind.name] = number
            Schema(id=number, data=definition, encoding=SchemaEncoding.ROS2, name=kind.name).write(builder)
        about = {
            "offered_qos_profiles": yaml.safe_dump(offered_qos(topic.delivery), sort_keys=False),
            "topic_type_hash": kind.hash,
        }
        schema = self._schemas[kind.name]
        number = self._mcap.register_channel(topic.name, MessageEncoding.CDR, schema, about)
        self._channels[topic.name] = number
        Channel(
            id=number,
            topic=topic.name,
            message_encoding=MessageEncoding.CDR,
            metadata=about,
            schema_id=schema,
        ).write(builder)
        # The writer keeps its own copies for the first chunk, and a chunk without messages is never written.
        self._file.write(builder.end())

    def add(self, topic: str, data: bytes, *, log_ns: int, publish_ns: int, sequence: int) -> None:
        """Add a message; times since the epoch [ns], log times never backwards."""
        self._mcap.add_message(self._channels[topic], log_ns, data, publish_ns, sequence)
        self._first_ns = self._first_ns or log_ns
        self._last_ns = log_ns
        self._messages += 1

    def flush(self) -> None:
        """Bring everything to the disk, where it is readable.

        Raises:
            OSError: The disk refuses; what it took before stays readable, the rest waits.
        """
        self._mcap.flush()
        self._file.flush()

    def finish(self) -> None:
        """Write the index and let go.

        Raises:
            OSError: The disk refuses. What it took before stays readable.
        """
        try:
            self._mcap.finish()
            self._file.finish()
        finally:
            self._file.close()

    def discard(self) -> None:
        """Let go of the file and remove it."""
        self._file.discard()

    def finish_if_there_is_room(self) -> None:
        """As `finish`, but without an index, which readers can do without, if the disk refuses that."""
        with contextlib.suppress(OSError):
            self.finish()
