"""One bag in memory, as far as it can be read: any rosbag2 folder with MCAP or sqlite3, or one such file."""

from __future__ import annotations

import contextlib
import json
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mcap.records import Attachment, Channel, Message, Metadata, Schema

from fulmar_bags.mcap_records import (
    PACKED,
    ZSTD_MAGIC,
    custom_text,
    file_bytes,
    files_of,
    missing_files,
    read_records,
    storage_of,
    unpack,
)
from fulmar_bags.message_types import unreadable
from fulmar_bags.metadata import metadata_refusal
from fulmar_bags.ring import FAULTS
from fulmar_bags.writer import RUN_KEY, RUN_RECORD
from fulmar_bags.writer_thread import RECORDING
from fulmar_core.config.errors import BagError, UnknownNameError
from fulmar_core.robots.topics import ODOMETRY, TRUTH, WIRES, Wire
from fulmar_core.wires.robot_name import PLAIN, Frames, namespace_of


@dataclass
class Topic:
    """The messages of one topic, in the order of the file."""

    name: str
    type: str  # such as `nav_msgs/msg/Odometry`
    data: list[bytes] = field(default_factory=list)  # in CDR
    log_ns: list[int] = field(default_factory=list)  # when each was received, since the epoch [ns]
    publish_ns: list[int] = field(default_factory=list)  # when each was sent; where unknown, as `log_ns` [ns]
    sequence: list[int] = field(default_factory=list)  # number of each, counted by its recorder; 0: not known
    unreadable: list[int] = field(default_factory=list)  # indices of those that are not what the type says

    def __len__(self) -> int:
        """Number of messages."""
        return len(self.data)

    def readable(self) -> Topic:
        """The messages that are what the type says."""
        if not self.unreadable:
            return self
        kept = sorted(set(range(len(self))).difference(self.unreadable))
        return Topic(
            self.name,
            self.type,
            [self.data[i] for i in kept],
            [self.log_ns[i] for i in kept],
            [self.publish_ns[i] for i in kept],
            [self.sequence[i] for i in kept],
        )


@dataclass(frozen=True)
class Fault:
    """Why a ring was written."""

    time_ns: int  # of its first sign, since the epoch [ns]
    reason: str


@dataclass(frozen=True)
class Bag:
    """One bag in memory."""

    path: Path
    storage: str  # `mcap` or `sqlite3`
    files: tuple[Path, ...]
    topics: dict[str, Topic]  # by absolute name, sorted
    info: dict[str, Any] | None  # what kind of run this is; None: Fulmar did not record it
    recording: dict[str, Any]  # the recorder's account of the messages
    faults: tuple[Fault, ...]  # that a ring was written for
    attachments: dict[str, bytes]
    warnings: tuple[str, ...]  # what could not be read

    @property
    def size(self) -> int:
        """Bytes of its files."""
        return sum(file.stat().st_size for file in self.files)

    @property
    def robot(self) -> str:
        """Type of the robot, empty where the bag does not say."""
        return str((self.info or {}).get("robot") or "")

    @property
    def name(self) -> str:
        """Name of the robot; its type in bags of earlier versions, which have no name; empty as `robot`."""
        return str((self.info or {}).get("name") or self.robot)

    @property
    def prefix(self) -> str:
        """Prefix of the robot's own topics; empty where the bag does not say."""
        return f"{namespace_of(self.name)}/" if self.name else ""

    @property
    def frames(self) -> Frames:
        """Frames of the messages, with the robot's prefix; the only odometry names it where the run record does not."""
        spaces = {space for topic in self.topics.values() if (space := _space_of(topic))}
        name = self.name or (spaces.pop() if len(spaces) == 1 else "")
        return Frames(f"{name}/") if name else PLAIN

    def number(self, name: str, default: float) -> float:
        """A number of the run record; `default` where it says nothing, or 0.

        Raises:
            BagError: It is no number.
        """
        try:
            return float((self.info or {}).get(name) or default)
        except (TypeError, ValueError) as error:
            raise BagError(f"the run record of the bag has an invalid {name}: {error}.") from error

    def relative(self, topic: str) -> str:
        """Name of a topic without the robot's prefix."""
        return topic.removeprefix(self.prefix)

    def of(self, wire: Wire) -> Topic:
        """The messages of a wire, none where the bag has none of them.

        Under the robot's name, or, where no robot is named, under the only namespace that has the wire.
        """
        name = self.topic_name(wire)
        found = [topic for topic in self.topics.values() if topic.name == name and topic.type == wire.type]
        return found[0] if found else Topic(name, wire.type)

    def topic_name(self, wire: Wire) -> str:
        """Absolute name of a wire's topic; the wire's own name where that is unknown."""
        if wire.name.startswith("/"):
            return wire.name
        if self.prefix:
            return f"{self.prefix}{wire.name}"
        own = (topic for topic in self.topics.values() if topic.type == wire.type)
        names = {topic.name for topic in own if is_of_wire(topic.name, wire)}
        return names.pop() if len(names) == 1 else wire.name

    def odometry(self, chosen: str | None = None) -> Topic:
        """The odometry: the one that was chosen, else what the robot measures, else its truth, else the only one.

        Args:
            chosen: Name of a topic.

        Raises:
            BagError: There is none, or several to choose from.
            ConfigError: There is no such topic.
        """
        kind = ODOMETRY.type
        known = {n: t for n, t in self.topics.items() if t.type == kind and len(t) > len(t.unreadable)}
        if chosen is not None:
            if chosen not in known:
                raise UnknownNameError(f"odometry topic in {self.path}:", chosen, known)
            return known[chosen]
        own = {name: topic for name, topic in known.items() if name.startswith(self.prefix)}
        for some in (own, known):
            measured = {name: topic for name, topic in some.items() if is_of_wire(name, ODOMETRY)}
            truths = {name: topic for name, topic in some.items() if is_of_wire(name, TRUTH)}
            only = measured or truths or some
            if len(only) == 1:
                return next(iter(only.values()))
        if not known:
            has = f"It has: {', '.join(self.topics) or 'nothing'}."
            raise BagError(" ".join([f"{self.path}: holds no {kind}. {has}", *self.warnings]))
        raise BagError(
            f"{self.path}: holds several odometries ({', '.join(known)}). Choose one: --odometry TOPIC."
        )


def _space_of(topic: Topic) -> str:
    """Name of the robot that a topic of odometry is of; empty for any other topic."""
    return topic.name.removesuffix(ODOMETRY.name).strip("/") if is_of_wire(topic.name, ODOMETRY) else ""


def is_of_wire(topic: str, wire: Wire) -> bool:
    """Whether the name of a topic, under any robot, is that of a wire, and of no other with a longer name."""
    ends = [other.name for other in (*WIRES, wire) if f"/{topic}".endswith(f"/{other.name.lstrip('/')}")]
    return bool(ends) and max(ends, key=len) == wire.name


def open_bag(path: Path) -> Bag:
    """Read a bag.

    Args:
        path: Bag folder, or a file in it.

    Returns:
        The bag. What is damaged is left out and named in `warnings`.

    Raises:
        BagError: There is no bag, or nothing of it can be read.
    """
    path = Path(path)
    files = files_of(path)
    gathered = _Gathered()
    problems: list[str] = []
    for file in files:
        try:
            gathered.read(file)
        except BagError as error:  # one file of several may be lost; the others count
            problems.append(str(error))
    if len(problems) == len(files):
        raise BagError(problems[0])
    gathered.check_types()
    beside = json_object(custom_text(path, RUN_RECORD))
    info = gathered.info or beside
    if info and beside and json.dumps(info, sort_keys=True) != json.dumps(beside, sort_keys=True):
        # A metadata record of MCAP has no checksum.
        problems.append(f"the record '{RUN_RECORD}' and metadata.yaml differ: one of them is damaged.")
    problems += [refusal] if (refusal := metadata_refusal(path if path.is_dir() else path.parent)) else []
    problems += [f"{name}: the file is missing; metadata.yaml lists it." for name in missing_files(path)]
    return Bag(
        path=path,
        storage=storage_of(files[0]) or "",
        files=files,
        topics=dict(sorted(gathered.topics.items())),
        info=info,
        recording=json_object(custom_text(path, RECORDING)) or {},
        faults=recorded_faults(gathered.faults or custom_text(path, FAULTS)),
        attachments=gathered.attachments,
        warnings=tuple(problems + gathered.warnings),
    )


class _Gathered:
    """Content of the files of one bag, together."""

    def __init__(self) -> None:
        self.topics: dict[str, Topic] = {}
        self.info: dict[str, Any] | None = None
        self.faults = ""  # JSON
        self.attachments: dict[str, bytes] = {}
        self.warnings: list[str] = []

    def read(self, file: Path) -> None:
        (self._read_sqlite3 if storage_of(file) == "sqlite3" else self._read_mcap)(file)

    def check_types(self) -> None:
        """Find the messages that do not fit the type of their topic."""
        for topic in self.topics.values():
            topic.unreadable = unreadable(topic.type, topic.data)
            if topic.unreadable:
                count = f"{len(topic.unreadable)} of {len(topic)} messages"
                self.warnings.append(f"{count} of {topic.name} are no {topic.type}.")

    def _topic(self, name: str, kind: str) -> Topic:
        """The topic of a name; one with another type gets a name with its type."""
        topic = self.topics.setdefault(name, Topic(name, kind))
        if topic.type == kind:
            return topic
        return self.topics.setdefault(f"{name} ({kind})", Topic(name, kind))

    @staticmethod
    def _add(topic: Topic, data: bytes, log_ns: int, publish_ns: int, sequence: int) -> None:
        # Where bags are compressed message by message, nothing in an MCAP file says so; CDR begins with a zero.
        topic.data.append(unpack(data) if data.startswith(ZSTD_MAGIC) else data)
        topic.log_ns.append(log_ns)
        topic.publish_ns.append(publish_ns or log_ns)
        topic.sequence.append(sequence)

    def _read_mcap(self, file: Path) -> None:
        schemas: dict[int, str] = {}
        channels: dict[int, Topic] = {}
        lost: Counter[str] = Counter()
        for record in read_records(file, self.warnings):
            if isinstance(record, Message):
                topic = channels.get(record.channel_id)
                if topic is None:
                    lost["messages of channels that are not announced"] += 1
                    continue
                self._add(topic, record.data, record.log_time, record.publish_time, record.sequence)
            elif isinstance(record, Schema):
                schemas[record.id] = record.name
            elif isinstance(record, Channel):
                # The index at the end of a file announces every channel once more.
                channels[record.id] = self._topic(record.topic, schemas.get(record.schema_id, ""))
                if record.message_encoding != "cdr":
                    lost[f"'{record.message_encoding}' as encoding of {record.topic}, only cdr is read"] = 1
            elif isinstance(record, Metadata) and record.name == RUN_RECORD:
                self.info = json_object(record.metadata.get(RUN_KEY, "")) or self.info
            elif isinstance(record, Metadata) and record.name == FAULTS:
                self.faults = record.metadata.get(FAULTS, "")
            elif isinstance(record, Attachment):
                self.attachments[record.name] = record.data
        self.warnings += [f"{file.name}: {count} {what}." for what, count in lost.items()]

    def _read_sqlite3(self, file: Path) -> None:
        from rosbags.rosbag2 import Reader

        try:
            with _plain(file, self.warnings) as plain, Reader(plain) as reader:
                topics = {each.id: self._topic(each.topic, each.msgtype) for each in reader.connections}
                try:
                    for connection, log_ns, data in reader.messages():
                        self._add(topics[connection.id], bytes(data), log_ns, 0, 0)
                except Exception as error:  # noqa: BLE001 - damage raises whatever it pleases, from sqlite3 or rosbags
                    self.warnings.append(f"{file.name}: the rest is damaged ({_first_line(error)}).")
        except Exception as error:
            raise BagError(f"{file}: this sqlite3 bag cannot be read: {_first_line(error)}.") from error


@contextlib.contextmanager
def _plain(file: Path, damage: list[str]) -> Iterator[Path]:
    """The file itself, or, where it is packed as a whole, what is in it."""
    if file.suffix != PACKED:
        yield file
        return
    with tempfile.TemporaryDirectory() as folder:
        plain = Path(folder) / file.stem
        plain.write_bytes(file_bytes(file, damage))
        yield plain


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [""])[0].rstrip(".") or type(error).__name__


def json_object(text: str) -> dict[str, Any] | None:
    """A JSON object, or None where the text is none."""
    try:
        value = json.loads(text)
    except (ValueError, RecursionError):
        return None
    return value if isinstance(value, dict) else None


def recorded_faults(text: str) -> tuple[Fault, ...]:
    """Faults of a ring from their JSON text; none where the text is not what a ring writes."""
    try:
        return tuple(Fault(int(each["time_ns"]), str(each["reason"])) for each in json.loads(text or "[]"))
    except (ValueError, TypeError, KeyError, RecursionError):
        return ()


def span_ns(topics: Iterable[Topic]) -> tuple[int, int]:
    """First and last time of recording [ns]; zeros where there is no message."""
    some = [topic.log_ns for topic in topics if len(topic)]
    return min(map(min, some), default=0), max(map(max, some), default=0)
