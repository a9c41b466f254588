"""One bag, as far as it can be read: any rosbag2 folder with MCAP or sqlite3, a bag of ROS 1, or one such file."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fulmar_bags.bag_reading import AS_IT_IS, BagReading
from fulmar_bags.gathered import Gathered, Topic, json_object
from fulmar_bags.mcap_records import custom_text, files_of, left_out_files, missing_files, storage_of
from fulmar_bags.metadata import metadata_refusal, read_information
from fulmar_bags.ring import FAULTS
from fulmar_bags.selection import Selection
from fulmar_bags.writer import RUN_RECORD
from fulmar_bags.writer_thread import RECORDING
from fulmar_core.config.errors import BagError, UnknownNameError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import ODOMETRY, TRUTH, WIRES, Wire
from fulmar_core.wires.robot_name import PLAIN, Frames, namespace_of

ROBOTS = "robots"  # key of a fleet's run record: the run record of each robot by its name


@dataclass(frozen=True)
class Fault:
    """Why a ring was written."""

    time_ns: int  # of its first sign, since the epoch [ns]
    reason: str


@dataclass(frozen=True)
class Bag:
    """One bag; messages that are large, or too many, stay in their file until they are looked at."""

    path: Path
    storage: str  # `mcap`, `sqlite3` or `rosbag1`
    files: tuple[Path, ...]
    topics: dict[str, Topic]  # by absolute name, sorted
    info: dict[str, Any] | None  # what kind of run this is; None: Fulmar did not record it
    recording: dict[str, Any]  # the recorder's account of the messages
    faults: tuple[Fault, ...]  # that a ring was written for
    attachments: dict[str, bytes]
    warnings: tuple[str, ...]  # what could not be read
    reading: BagReading = AS_IT_IS  # what was said about it

    @property
    def robots(self) -> tuple[str, ...]:
        """Names of the robots of a fleet; empty where the bag is of one robot."""
        every = (self.info or {}).get(ROBOTS)
        return tuple(every) if isinstance(every, dict) else ()

    def of_robot(self, name: str) -> Bag:
        """The bag of a fleet as that of one robot: its run record, its attachments, and no topic of another robot.

        Raises:
            ConfigError: The fleet has no robot of this name.
        """
        if name not in self.robots:
            raise UnknownNameError(f"robot in {self.path}:", name, self.robots)
        assert self.info is not None
        shared = {key: self.info[key] for key in ("fleet", "least_distance") if key in self.info}
        own = {
            key.removeprefix(f"{name}/"): data for key, data in self.attachments.items() if _is_of(key, name)
        }
        others = tuple(f"{namespace_of(other)}/" for other in self.robots if other != name)
        topics = {topic: found for topic, found in self.topics.items() if not topic.startswith(others)}
        reading = replace(self.reading, robot=None)
        info = {**shared, **self.info[ROBOTS][name]}
        return replace(self, info=info, topics=topics, attachments=own, reading=reading)

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
        if self.name:
            return Frames(f"{self.name}/")
        spaces = {space for topic in self.topics.values() if (space := _space_of(topic))}
        return Frames(f"{spaces.pop()}/") if len(spaces) == 1 else PLAIN

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
        if wire.name in self.reading.topics:
            return self.reading.topics[wire.name]
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
        kind, chosen = ODOMETRY.type, chosen or self.reading.topics.get(ODOMETRY.name)
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
            f"{self.path}: holds several odometries ({', '.join(known)}). Choose one: --topics odom=TOPIC."
        )


def _is_of(attachment: str, robot: str) -> bool:
    """Whether an attachment of a fleet's bag is that of a robot, or of all."""
    return "/" not in attachment or attachment.startswith(f"{robot}/")


def _space_of(topic: Topic) -> str:
    """Name of the robot that a topic of odometry is of; empty for any other topic."""
    return topic.name.removesuffix(ODOMETRY.name).strip("/") if is_of_wire(topic.name, ODOMETRY) else ""


def is_of_wire(topic: str, wire: Wire) -> bool:
    """Whether the name of a topic, under any robot, is that of a wire, and of no other with a longer name."""
    ends = [other.name for other in (*WIRES, wire) if f"/{topic}".endswith(f"/{other.name.lstrip('/')}")]
    return bool(ends) and max(ends, key=len) == wire.name


def open_bag(path: Path, reading: BagReading = AS_IT_IS, selection: Selection | None = None) -> Bag:
    """Read a bag.

    Args:
        path: Bag folder, or a file in it.
        reading: What the bag does not say itself.
        selection: Topics that are read; by default all.

    Returns:
        The bag. What is damaged is left out and named in `warnings`.

    Raises:
        BagError: There is no bag, or nothing of it can be read.
        ConfigError: It has not the topics of `reading`, or no such robot.
    """
    path = Path(path)
    files = files_of(path)
    selection = selection or Selection()
    selection.begin([file.stat().st_size for file in files])
    gathered = Gathered(selection)
    problems: list[str] = []
    for file in files:
        try:
            gathered.read(file)
        except BagError as error:  # one file of several may be lost; the others count
            problems.append(str(error))
    if len(problems) == len(files):
        raise BagError(problems[0])
    gathered.finish()
    beside = json_object(custom_text(path, RUN_RECORD))
    info = gathered.info or beside
    if info and beside and json.dumps(info, sort_keys=True) != json.dumps(beside, sort_keys=True):
        # A metadata record of MCAP has no checksum.
        problems.append(f"the record '{RUN_RECORD}' and metadata.yaml differ: one of them is damaged.")
    problems += [refusal] if (refusal := metadata_refusal(path if path.is_dir() else path.parent)) else []
    problems += [f"{name}: the file is missing; metadata.yaml lists it." for name in missing_files(path)]
    problems += [f"{name} is left out: {why}." for name, why in left_out_files(path, files)]
    problems += _fewer_than_listed(path, gathered) if selection.is_whole and not problems else []
    reading.check(path, {topic.name: topic.type for topic in gathered.topics.values()})
    found = Bag(
        reading=reading,
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
    if reading.robot and found.robots:
        return found.of_robot(reading.robot)
    if reading.robot:
        load_robot(reading.robot)
    return found


def _fewer_than_listed(path: Path, gathered: Gathered) -> list[str]:
    """A line where nothing else says why messages are missing that metadata.yaml counts."""
    listed = read_information(path).get("message_count") if path.is_dir() else None
    found = sum(len(topic) for topic in gathered.topics.values())
    if gathered.warnings or not isinstance(listed, int) or found >= listed:
        return []
    return [f"metadata.yaml counts {listed} messages, {found} are in the files."]


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
