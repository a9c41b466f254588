"""Writes one rosbag2 folder: an MCAP file and its `metadata.yaml`. Knows no rclpy.

What was flushed is readable by every rosbag2 and MCAP reader, whatever happens to the process afterwards.
"""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from mcap.well_known import MessageEncoding, Profile, SchemaEncoding
from mcap.writer import Writer

from fulmar_core.errors import BagError
from fulmar_core.topics import Delivery
from fulmar_ros.bag_file import BagFile
from fulmar_ros.bag_metadata import BagSpan, TopicCount, write_metadata
from fulmar_ros.bag_types import MessageType, message_type, offered_qos

RUN_RECORD = "fulmar"  # name of the MCAP metadata record and of the entry in `custom_data`
RUN_KEY = "run"
FLUSH_EVERY_S = 1.0
CHUNK_BYTES = 1 << 20


@dataclass
class _Channel:
    number: int
    name: str
    type: MessageType
    delivery: Delivery
    messages: int = 0


class BagWriter:
    """One bag being written.

    The caller drives time: `tick` flushes once a second, so at most that much is lost with the process.
    """

    def __init__(
        self, directory: Path, *, run_info: Mapping[str, Any], attachments: Mapping[str, bytes] | None = None
    ) -> None:
        """Create the bag; it is valid, though empty, from here on.

        Args:
            directory: The bag folder; absent or empty, its parents are made.
            run_info: What kind of run this is, anything that JSON can hold.
            attachments: Files to carry along, by name.

        Raises:
            BagError: There is something in the folder already, or it cannot be written.
        """
        if directory.exists() and (not directory.is_dir() or any(directory.iterdir())):
            raise BagError(f"{directory} exists already, and bags are never overwritten. Name a new folder.")
        self.directory = directory
        self._run = json.dumps(run_info, sort_keys=True)
        self._file_name = f"{directory.resolve().name}_0.mcap"
        self._channels: dict[str, _Channel] = {}
        self._schemas: dict[str, int] = {}
        self._first_ns, self._last_ns = 0, 0
        self._written = self._flushed = 0
        self._next_flush: float | None = None
        try:
            directory.mkdir(parents=True, exist_ok=True)
            self._file = BagFile(directory / self._file_name)
            self._open(attachments or {})
            self.flush()
        except OSError as error:
            raise BagError(f"{directory}: cannot write a bag here: {error.strerror}.") from error

    def _open(self, attachments: Mapping[str, bytes]) -> None:
        self._mcap = Writer(self._file, chunk_size=CHUNK_BYTES)
        self._mcap.start(profile=Profile.ROS2, library="fulmar")
        self._mcap.add_metadata(RUN_RECORD, {RUN_KEY: self._run})
        now = time.time_ns()
        for name, data in attachments.items():
            self._mcap.add_attachment(now, now, name, "application/octet-stream", data)

    @property
    def messages(self) -> int:
        """Messages given so far."""
        return self._written

    @property
    def messages_on_disk(self) -> int:
        """Messages that a reader of the bag finds now."""
        return self._flushed

    @property
    def size(self) -> int:
        """Bytes of the MCAP file on disk."""
        return self._file.size

    @property
    def waiting(self) -> int:
        """Bytes that the disk has not taken yet, without the chunk in progress."""
        return self._file.waiting

    def add_topic(self, name: str, type_name: str, delivery: Delivery) -> None:
        """Announce a topic.

        Args:
            name: Absolute topic name.
            type_name: Such as `nav_msgs/msg/Odometry`.
            delivery: How its publishers offer it.

        Raises:
            BagError: Unknown type.
        """
        kind = message_type(type_name)
        if type_name not in self._schemas:
            self._schemas[type_name] = self._mcap.register_schema(
                type_name, SchemaEncoding.ROS2, kind.definition.encode()
            )
        number = self._mcap.register_channel(
            name,
            MessageEncoding.CDR,
            self._schemas[type_name],
            {
                "offered_qos_profiles": yaml.safe_dump(offered_qos(delivery), sort_keys=False),
                "topic_type_hash": kind.hash,
            },
        )
        self._channels[name] = _Channel(number, name, kind, delivery)

    def write(self, topic: str, data: bytes, *, log_ns: int, publish_ns: int | None = None) -> None:
        """Add a message.

        Args:
            topic: A name given to `add_topic`.
            data: The message in CDR.
            log_ns: When it came, since the epoch [ns]. Earlier than the one before counts as the same time.
            publish_ns: When it was sent, if known [ns].
        """
        channel = self._channels[topic]
        self._first_ns = self._first_ns or log_ns
        self._last_ns = max(log_ns, self._last_ns)
        channel.messages += 1
        self._written += 1
        self._mcap.add_message(
            channel.number, self._last_ns, data, publish_ns or self._last_ns, channel.messages
        )

    def tick(self, now: float) -> None:
        """Flush if the last flush is a second ago; call this several times a second.

        Args:
            now: Any steady clock [s].

        Raises:
            OSError: As `flush`.
        """
        if self._next_flush is None:
            self._next_flush = now + FLUSH_EVERY_S
        if now >= self._next_flush:
            self._next_flush = now + FLUSH_EVERY_S
            self.flush()

    def flush(self) -> None:
        """Bring every message to the disk.

        Raises:
            OSError: The disk refuses. What it took before stays readable; the rest is tried again next time.
        """
        self._mcap.flush()
        self._note_flushed()

    def close(self) -> None:
        """Write the rest, the index and the final counts, and let go.

        Raises:
            OSError: The disk refuses. What it took before stays readable.
        """
        try:
            self._mcap.finish()
            self._file.finish()
            self._note_flushed()
        finally:
            self._file.close()

    def _note_flushed(self) -> None:
        self._flushed = self._written
        topics = [
            TopicCount(c.name, c.type.name, c.type.hash, offered_qos(c.delivery), c.messages)
            for c in self._channels.values()
        ]
        span = BagSpan(self._written, self._first_ns, self._last_ns)
        write_metadata(self.directory, self._file_name, span, topics, {RUN_RECORD: self._run})
