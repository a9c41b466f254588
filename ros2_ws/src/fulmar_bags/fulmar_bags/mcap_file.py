"""One MCAP file of a bag, complete after each piece that is written.

MCAP readers want a footer at the end. This file carries a provisional one (without an index) that every new
piece overwrites in the same write, so that neither SIGKILL nor a full disk leaves a file that readers refuse.
"""

from __future__ import annotations

import contextlib
import errno
import os
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, cast

import yaml
from mcap.data_stream import RecordBuilder
from mcap.records import Channel, DataEnd, Footer, Schema
from mcap.well_known import MessageEncoding, Profile, SchemaEncoding
from mcap.writer import MCAP0_MAGIC, Writer

from fulmar_bags.message_types import MessageType, offered_qos
from fulmar_bags.metadata import BagSpan
from fulmar_core.config.atomic_write import sync_folder
from fulmar_core.robots.topics import Delivery


def _provisional_end() -> bytes:
    builder = RecordBuilder()
    DataEnd(data_section_crc=0).write(builder)
    Footer(summary_start=0, summary_offset_start=0, summary_crc=0).write(builder)
    return builder.end() + MCAP0_MAGIC


PROVISIONAL_END = _provisional_end()
BEGUN = ".begun"  # ending of a file without content; a power cut may leave it to one with content


def mcap_writer(file: BagFile, **options: Any) -> Writer:
    """An MCAP writer, which needs no more of its stream than `BagFile` has."""
    return Writer(cast(IO[Any], file), **options)


class BagFile:
    """The file below an MCAP writer; bytes wait in memory until `flush`.

    It gets its name with the first flush, so that readers never find an empty file, which they refuse.
    """

    def __init__(self, path: Path) -> None:
        """Create the file, under the name that it has until the first flush.

        Raises:
            OSError: It exists, or cannot be created.
        """
        if path.exists():
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path))
        self._path, self._nameless = path, path.with_name(path.name + BEGUN)
        self._descriptor = os.open(self._nameless, os.O_CREAT | os.O_EXCL | os.O_WRONLY | os.O_CLOEXEC, 0o644)
        self._waiting = bytearray()
        self._named = False
        self._on_disk = 0  # bytes, without the provisional end

    @property
    def waiting(self) -> int:
        """Bytes that are not on disk yet."""
        return len(self._waiting)

    @property
    def size(self) -> int:
        """Bytes on disk, without the provisional end."""
        return self._on_disk

    def tell(self) -> int:
        """Where the next byte will go."""
        return self._on_disk + len(self._waiting)

    def write(self, data: bytes) -> int:
        """Keep bytes for the next `flush`."""
        self._waiting += data
        return len(data)

    def flush(self) -> None:
        """Write waiting bytes and the provisional end to the disk.

        Raises:
            OSError: The disk refuses. The file then ends as before, and the bytes go on waiting.
        """
        self._append(PROVISIONAL_END)

    def finish(self) -> None:
        """Write waiting bytes, which end with a footer of their own, to the disk; raises as `flush`."""
        self._append(b"")

    def close(self) -> None:
        """Close the file; waiting bytes are lost, and so is a file that never got a name."""
        os.close(self._descriptor)
        if not self._named:
            self._nameless.unlink(missing_ok=True)

    def discard(self) -> None:
        """Close the file and remove it."""
        self.close()
        self._path.unlink(missing_ok=True)

    def _append(self, end: bytes) -> None:
        try:
            self._write_at(self._on_disk, bytes(self._waiting) + end)
            os.ftruncate(self._descriptor, self._on_disk + len(self._waiting) + len(end))
            os.fdatasync(self._descriptor)
        except OSError:
            os.ftruncate(self._descriptor, self._on_disk)
            self._write_at(self._on_disk, PROVISIONAL_END)
            raise
        if not self._named:
            os.rename(self._nameless, self._path)
            self._named = True
            sync_folder(self._path.parent)
        self._on_disk += len(self._waiting)
        self._waiting.clear()

    def _write_at(self, offset: int, data: bytes) -> None:
        while data:
            written = os.pwrite(self._descriptor, data, offset)
            offset, data = offset + written, data[written:]


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
        """Write metadata records and attachments by name, and topics announced before this file was begun."""
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
        """Announce a topic; its definition is written with the next flush, even without a message."""
        kind, definition = topic.type, topic.type.definition.encode()
        # The writer puts definitions into its chunk, which reaches the disk only with a message in it.
        chunk = getattr(self._mcap, "_Writer__chunk_builder")  # noqa: B009 - a private name of another class
        alone, builder = not chunk.num_messages, RecordBuilder()
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
        if alone:
            chunk.reset()
            self._file.write(builder.end())

    def add(self, topic: str, data: bytes, *, log_ns: int, publish_ns: int, sequence: int) -> None:
        """Add a message; times since the epoch [ns], log times never backwards."""
        self._mcap.add_message(self._channels[topic], log_ns, data, publish_ns, sequence)
        self._first_ns = self._first_ns or log_ns
        self._last_ns = log_ns
        self._messages += 1

    def flush(self) -> None:
        """Write everything to the disk, where it is readable.

        Raises:
            OSError: The disk refuses; what it took before stays readable, the rest waits.
        """
        self._mcap.flush()
        self._file.flush()

    def finish(self) -> None:
        """Write the index and close the file.

        Raises:
            OSError: The disk refuses. What it took before stays readable.
        """
        try:
            self._mcap.finish()
            self._file.finish()
        finally:
            self._file.close()

    def discard(self) -> None:
        """Close the file and remove it."""
        self._file.discard()

    def finish_if_there_is_room(self) -> None:
        """As `finish`, but without the index, which readers can do without, if the disk is full."""
        with contextlib.suppress(OSError):
            self.finish()
