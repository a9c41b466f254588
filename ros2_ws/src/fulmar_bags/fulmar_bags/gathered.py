"""What the files of one bag hold, together, whatever storage each has."""

from __future__ import annotations

import json
from array import array
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from mcap.records import Attachment, Channel, Metadata, Schema

from fulmar_bags.mcap_records import ZSTD_MAGIC, McapFile, PlacedMessage, storage_of, unpack
from fulmar_bags.message_types import unreadable
from fulmar_bags.ring import FAULTS
from fulmar_bags.ros1_records import Ros1File, converter
from fulmar_bags.selection import Selection
from fulmar_bags.sqlite_records import SqliteFile
from fulmar_bags.statuses import unreadable_statuses
from fulmar_bags.stored_bytes import PIECE, Payloads, Room, Source, picked
from fulmar_bags.writer import RUN_KEY, RUN_RECORD
from fulmar_core.robots.topics import DIAGNOSTICS

MOST_ATTACHED = 100_000_000  # bytes of all attachments together


@dataclass
class Topic:
    """The messages of one topic, in the order of their recording."""

    name: str
    type: str  # such as `nav_msgs/msg/Odometry`
    data: Sequence[bytes] = field(default_factory=list)  # in CDR
    log_ns: Sequence[int] = field(default_factory=list)  # when each was received, since the epoch [ns]
    publish_ns: Sequence[int] = field(
        default_factory=list
    )  # when each was sent; where unknown, as `log_ns` [ns]
    sequence: Sequence[int] = field(
        default_factory=list
    )  # number of each, counted by its recorder; 0: not known
    unreadable: list[int] = field(default_factory=list)  # indices of those that are not what the type says

    def __len__(self) -> int:
        """Number of messages."""
        return len(self.data)

    def readable(self) -> Topic:
        """The messages that are what the type says."""
        if not self.unreadable:
            return self
        return self.chosen(np.setdiff1d(np.arange(len(self)), self.unreadable))

    def chosen(self, numbers: np.ndarray) -> Topic:
        """Some of the messages, in the order of their numbers as given; all of them have to be readable."""
        columns = (self.data, self.log_ns, self.publish_ns, self.sequence)
        data, log_ns, publish_ns, sequence = (picked(column, numbers) for column in columns)
        return Topic(self.name, self.type, data, log_ns, publish_ns, sequence)


class Gathered:
    """Content of the files of one bag, together."""

    def __init__(self, selection: Selection | None = None) -> None:
        """Begin without a file; of each, topics that the selection does not want are left out."""
        self.topics: dict[str, Topic] = {}
        self._selection = selection or Selection()
        self.info: dict[str, Any] | None = None
        self.faults = ""  # JSON
        self.attachments: dict[str, bytes] = {}
        self.warnings: list[str] = []
        self._room = Room()
        self._unchecked: dict[
            int, tuple[Topic, list[bytes]]
        ] = {}  # newest messages, by the identity of their topic
        self._waiting = 0  # bytes of them

    def read(self, file: Path) -> None:
        """Add what is in a file.

        Raises:
            BagError: Nothing of it can be read.
        """
        selection = self._selection
        selection.begin_file()
        reader: Any = _READERS[storage_of(file) or ""](file, self.warnings, selection)
        schemas: dict[int, str] = {}
        channels: dict[int, tuple[Topic, Source, Callable[[bytes], bytes]]] = {}
        lost: Counter[str] = Counter()
        for record in reader.records(self.warnings):
            if isinstance(record, PlacedMessage):
                if record.channel_id in selection.skipped:
                    continue
                channel = channels.get(record.channel_id)
                if channel is None:
                    lost["messages of channels that are not announced"] += 1
                    continue
                self._add(record, *channel)
            elif isinstance(record, Schema):
                schemas[record.id] = record.name
                selection.see(record)
            elif isinstance(record, Channel):
                selection.see(record)
                if record.id in selection.skipped:
                    continue
                # The index at the end of a file announces every channel once more.
                known = channels.get(record.id)
                topic = self._topic(record.topic, schemas.get(record.schema_id, ""))
                if known is None or known[0] is not topic:
                    channels[record.id] = (topic, *_way_of(record, topic, reader))
                if record.message_encoding not in ("cdr", "ros1"):
                    lost[f"'{record.message_encoding}' as encoding of {record.topic}, only cdr is read"] = 1
            elif isinstance(record, Metadata) and record.name == RUN_RECORD:
                self.info = json_object(record.metadata.get(RUN_KEY, "")) or self.info
            elif isinstance(record, Metadata) and record.name == FAULTS:
                self.faults = record.metadata.get(FAULTS, "")
            elif isinstance(record, Attachment):
                self._attach(record, file)
        self.warnings += [f"{file.name}: {count} {what}." for what, count in lost.items()]
        self._check()

    def finish(self) -> None:
        """Bring the messages of each topic into the order of their recording, and count those that do not fit."""
        for name, topic in self.topics.items():
            log_ns = np.array(topic.log_ns, dtype=np.int64)
            if (np.diff(log_ns) < 0).any():
                order = np.argsort(log_ns, kind="stable")
                place = np.empty_like(order)
                place[order] = np.arange(len(order))
                self.topics[name] = topic.chosen(order)
                self.topics[name].unreadable = sorted(place[topic.unreadable].tolist())
            if topic.unreadable:
                count = f"{len(topic.unreadable)} of {len(topic)} messages"
                self.warnings.append(f"{count} of {topic.name} are no {topic.type}.")

    def _topic(self, name: str, kind: str) -> Topic:
        """The topic of a name; one with another type gets a name with its type."""
        for key in (name, f"{name} ({kind})"):
            if key not in self.topics:
                data = [] if kind in self._selection.kept else Payloads(self._room)
                self.topics[key] = Topic(name, kind, data, array("q"), array("q"), array("L"))
            if self.topics[key].type == kind:
                break
        return self.topics[key]

    def _add(
        self, record: PlacedMessage, topic: Topic, source: Source, convert: Callable[[bytes], bytes]
    ) -> None:
        data = convert(record.data)
        if isinstance(topic.data, list):
            topic.data.append(data)
        else:
            assert isinstance(topic.data, Payloads)
            topic.data.append(data, source, record.outer, record.at, len(record.data))
        for column, value in (
            (topic.log_ns, record.log_time),
            (topic.publish_ns, record.publish_time or record.log_time),
            (topic.sequence, record.sequence),
        ):
            column.append(min(value, _LATEST))  # type: ignore[attr-defined]
        if not self._selection.checks:
            return
        self._unchecked.setdefault(id(topic), (topic, []))[1].append(data)
        self._waiting += len(data)
        if self._waiting > 4 * PIECE:
            self._check()

    def _check(self) -> None:
        """Find those of the newest messages that do not fit the type of their topic."""
        for topic, newest in self._unchecked.values():
            first = len(topic) - len(newest)
            known = topic.type == DIAGNOSTICS.type  # most of a bag's texts, which take long to walk through
            bad = unreadable_statuses(newest) if known else unreadable(topic.type, newest)
            topic.unreadable += [first + index for index in bad]
        self._unchecked.clear()
        self._waiting = 0

    def _attach(self, record: Attachment, file: Path) -> None:
        if sum(map(len, self.attachments.values())) + len(record.data) > MOST_ATTACHED:
            self.warnings.append(f"{file.name}: the attached '{record.name}' is too large and was left out.")
            return
        self.attachments[record.name] = record.data


_LATEST = 2**63 - 1
_READERS: dict[str, Callable[[Path, list[str], Selection], Any]] = {
    "mcap": lambda path, _, selection: McapFile(path, selection),
    "sqlite3": lambda path, warnings, _: SqliteFile(path, warnings),
    "rosbag1": lambda path, _warnings, _: Ros1File(path),
}


@dataclass(frozen=True)
class _Converted:
    """A source whose messages become CDR when they are looked at."""

    source: Source
    convert: Callable[[bytes], bytes]

    def read(self, outer: int, at: int, length: int) -> bytes:
        return self.convert(self.source.read(outer, at, length))


def _unpacked(data: bytes) -> bytes:
    # Where bags are compressed message by message, nothing in an MCAP file says so; CDR begins with a zero.
    return unpack(data) if data.startswith(ZSTD_MAGIC) else data


def _way_of(channel: Channel, topic: Topic, reader: Source) -> tuple[Source, Callable[[bytes], bytes]]:
    """Where messages of a channel are read again, and what makes CDR of them."""
    convert = converter(topic.type) if channel.message_encoding == "ros1" else _unpacked
    return _Converted(reader, convert), convert


def json_object(text: str) -> dict[str, Any] | None:
    """A JSON object, or None where the text is none."""
    try:
        value = json.loads(text)
    except (ValueError, RecursionError):
        return None
    return value if isinstance(value, dict) else None
