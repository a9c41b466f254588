"""Writes one rosbag2 folder: MCAP files one after the other and their `metadata.yaml`. Knows no rclpy.

What was flushed is readable by every rosbag2 and MCAP reader, whatever happens to the process afterwards.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Any

from fulmar_bags.interrupted_bag import FinishedPart, interrupted_bag
from fulmar_bags.mcap_file import BagPart, Topic
from fulmar_bags.message_types import message_type, offered_qos
from fulmar_bags.metadata import BagSpan, TopicCount, write_metadata
from fulmar_core.config.atomic_write import sync_folder
from fulmar_core.config.errors import BagError
from fulmar_core.robots.topics import Delivery

RUN_RECORD = "fulmar"  # name of the MCAP metadata record and of the entry in `custom_data`
RUN_KEY = "run"
# A bag may lack the last second at most; the disk, and a machine that is busy, get the other half of it.
FLUSH_EVERY_S = 0.5


@dataclass(frozen=True, slots=True)
class BagCounts:
    """Messages and bytes of a bag so far."""

    messages: int = 0  # given
    on_disk: int = 0  # messages that a reader of the bag finds now
    files: int = 0  # MCAP files
    size: int = 0  # of them on disk [bytes]

    def __add__(self, other: BagCounts) -> BagCounts:
        """Counts of two bags together."""
        return BagCounts(*(a + b for a, b in zip(astuple(self), astuple(other), strict=True)))


class BagWriter:
    """One bag being written; the caller's `tick` flushes twice a second, so a crash loses at most a second."""

    def __init__(
        self,
        directory: Path,
        *,
        run_info: Mapping[str, Any],
        attachments: Mapping[str, bytes] | None = None,
        split_bytes: float = 0.0,
        split_s: float = 0.0,
        resume: bool = False,
    ) -> None:
        """Create the bag; it is valid, though empty, from here on.

        Args:
            directory: The bag folder; absent or empty, its parents are made.
            run_info: What kind of run this is, anything that JSON can hold.
            attachments: Files to carry along in each MCAP file, by name.
            split_bytes: A file of this size is followed by a new one; 0: never.
            split_s: So is one that was begun so long ago; 0: never [s].
            resume: Whether a bag that a dead recorder left in the folder goes on, in a further file.

        Raises:
            BagError: There is something in the folder already, and it is not to go on; or it cannot be written.
        """
        if not resume:
            check_free(directory)
        self.directory = directory
        self._records = {RUN_RECORD: {RUN_KEY: json.dumps(run_info, sort_keys=True)}}
        self._attachments = dict(attachments or {})
        self._split_bytes, self._split_s = split_bytes, split_s
        self._topics: dict[str, Topic] = {}
        before = interrupted_bag(directory)
        self._messages_before = before.messages
        self._notes = {name: text for name, text in before.notes.items() if name != RUN_RECORD}
        self._finished: list[FinishedPart] = list(before.parts)
        self._begun = before.next_number
        self._last_ns = before.last_ns
        self._written = self._flushed = 0
        self._next_flush: float | None = None
        self._split_at = float("inf")
        try:
            directory.mkdir(parents=True, exist_ok=True)
            sync_folder(directory.parent)
            self._part = self._new_part()
            try:
                self.flush()
            except OSError:  # the folder stays free for another try
                self._part.discard()
                raise
        except OSError as error:
            raise BagError(f"{directory}: cannot write a bag here: {error.strerror}.") from error

    @property
    def counts(self) -> BagCounts:
        """Messages that this writer was given, and all files, those of an interrupted bag among them."""
        sizes = [*(part.size for part in self._finished), self._part.size]
        return BagCounts(self._written, self._flushed, len(sizes), sum(sizes))

    @property
    def waiting(self) -> int:
        """Bytes that the disk has not taken yet, without the chunk in progress."""
        return self._part.waiting

    def add_topic(self, name: str, type_name: str, delivery: Delivery) -> None:
        """Announce a topic by its absolute name, its type such as `nav_msgs/msg/Odometry`, and its delivery.

        Raises:
            BagError: Unknown type.
        """
        before = self._messages_before.get(name, 0)
        self._topics[name] = Topic(name, message_type(type_name), delivery, messages=before)
        self._part.add_topic(self._topics[name])

    def write(self, topic: str, data: bytes, *, log_ns: int, publish_ns: int | None = None) -> None:
        """Add a message.

        Args:
            topic: A name given to `add_topic`.
            data: The message in CDR.
            log_ns: When it was received, by the recorder's wall clock, since the epoch [ns]. Earlier than the one
                before counts as the same time.
            publish_ns: When it was sent, by the sender's wall clock, since the epoch [ns]. None or 0: not known, and
                the log time is written instead. Simulated time is in the stamps of the messages alone.
        """
        there = self._topics[topic]
        self._last_ns = max(log_ns, self._last_ns)
        there.messages += 1
        self._written += 1
        self._part.add(
            topic,
            data,
            log_ns=self._last_ns,
            publish_ns=publish_ns or self._last_ns,
            sequence=there.messages,
        )

    def attach(self, name: str, data: bytes) -> None:
        """Attach a file to this MCAP file and all that follow."""
        self._attachments[name] = data
        self._part.attach(name, data)

    def note(self, name: str, text: str) -> None:
        """Write a text into `custom_data` with the next flush; the last text of a name stays."""
        self._notes[name] = text

    def tick(self, now: float) -> None:
        """Flush if the last flush is half a second ago, and begin a new file where one is due; `now` is steady [s].

        Raises:
            OSError: As `flush`.
        """
        if self._next_flush is None:
            self._next_flush, self._split_at = now + FLUSH_EVERY_S, now + (self._split_s or float("inf"))
        if now < self._next_flush:
            return
        self._next_flush = now + FLUSH_EVERY_S
        self.flush()
        if now >= self._split_at or 0 < self._split_bytes <= self._part.size:
            self.split()
            self._split_at = now + (self._split_s or float("inf"))

    def flush(self) -> None:
        """Bring every message to the disk.

        Raises:
            OSError: The disk refuses. What it took before stays readable; the rest is tried again next time.
        """
        self._part.flush()
        self._note_flushed()

    def split(self) -> None:
        """Go on in a new file; one without messages is not left behind.

        Raises:
            OSError: As `flush`; the old file goes on.
        """
        if not self._part.span.messages:
            return
        self.flush()
        following = self._new_part()
        self._part.finish_if_there_is_room()
        self._finished.append(FinishedPart(self._part.name, self._part.span, self._part.size))
        self._part = following
        self.flush()

    def close(self) -> None:
        """Write the rest, the index and the final counts, and close the bag.

        Raises:
            OSError: The disk refuses. What it took before stays readable.
        """
        for name, text in self._notes.items():
            self._part.add_record(name, {name: text})
        self._part.finish()
        self._note_flushed()

    def _new_part(self) -> BagPart:
        part = BagPart(self.directory / f"{self.directory.resolve().name}_{self._begun}.mcap")
        self._begun += 1
        part.begin(self._records, self._attachments, self._topics.values())
        return part

    def _note_flushed(self) -> None:
        self._flushed = self._written
        topics = [
            TopicCount(t.name, t.type.name, t.type.hash, offered_qos(t.delivery), t.messages)
            for t in self._topics.values()
        ]
        spans: dict[str, BagSpan] = {part.name: part.span for part in self._finished}
        spans[self._part.name] = self._part.span
        custom = {RUN_RECORD: self._records[RUN_RECORD][RUN_KEY], **self._notes}
        write_metadata(self.directory, spans, topics, custom)


def check_free(directory: Path) -> None:
    """Raise BagError where a folder is not empty, since bags are never overwritten."""
    if directory.exists() and (not directory.is_dir() or any(directory.iterdir())):
        raise BagError(f"{directory} exists already, and bags are never overwritten. Name a new folder.")
