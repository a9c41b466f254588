"""Recovers a bag that a power cut or a damaged disk left incomplete."""

from __future__ import annotations

import os
from array import array
from collections import Counter
from dataclasses import replace
from pathlib import Path

from mcap.records import Attachment, Channel, Message, Metadata, Schema
from mcap.well_known import Profile

from fulmar_bags.mcap_file import BagFile, mcap_writer
from fulmar_bags.mcap_records import bag_files, plain_name, read_records
from fulmar_bags.metadata import BagSpan, TopicCount, read_custom, write_metadata
from fulmar_bags.stored_bytes import PIECE
from fulmar_core.config import yaml_text
from fulmar_core.config.atomic_write import sync_folder
from fulmar_core.config.errors import BagError

_QOS = "offered_qos_profiles"  # of a channel's metadata: YAML in a text


def recover(directory: Path) -> tuple[str, ...]:
    """Rewrite the MCAP files of a bag and its `metadata.yaml` with everything that can still be read.

    A file that lost its name with the power gets it back. Each new file replaces the old one in one step. Where
    something could not be read, the old file stays beside it as `<name>.damaged`; one that holds nothing at all goes.

    Returns:
        One line for each part that could not be read; empty if the bag was whole.

    Raises:
        BagError: There is no MCAP file, none can be read at all, or the disk refuses a new one.
    """
    damage: list[str] = []
    copies: dict[str, _Copy] = {}
    paths = bag_files(directory)
    for path in paths:
        try:
            copies[plain_name(path).name] = _rewritten(path, damage)
        except BagError as error:  # a disk that failed while a file was begun
            if len(paths) == 1:
                raise
            damage.append(str(error))
            path.replace(path.with_name(f"{path.name}.damaged"))
        except OSError as error:
            raise BagError(f"{directory}: cannot write the recovered bag: {error.strerror}.") from error
    if not copies:
        raise BagError(f"{directory}: nothing can be read. {damage[0]}")
    recorded = {name: text for copy in copies.values() for name, text in copy.custom.items()}
    custom = {**read_custom(directory), **recorded}
    try:
        spans = {name: copy.span() for name, copy in copies.items()}
        write_metadata(directory, spans, _all_topics(list(copies.values())), custom)
    except OSError as error:
        raise BagError(f"{directory}: cannot write the recovered bag: {error.strerror}.") from error
    return tuple(damage)


def _rewritten(path: Path, damage: list[str]) -> _Copy:
    """Replace one file by what can be read of it."""
    already = len(damage)
    new = path.with_name(f".{path.name}.new")
    new.unlink(missing_ok=True)
    try:
        copy = _Copy(new, path, damage)
        for record in read_records(path, damage):
            copy.add(record)
        copy.finish()
        if len(damage) > already:
            path.with_name(f"{path.name}.damaged").unlink(missing_ok=True)
            os.link(path, path.with_name(f"{path.name}.damaged"))
        new.replace(plain_name(path))
        if path != plain_name(path):
            path.unlink()
        sync_folder(path.parent)
    finally:
        new.unlink(missing_ok=True)
    return copy


def _all_topics(copies: list[_Copy]) -> list[TopicCount]:
    """Topics of all files, each once, with its messages in all of them."""
    together: dict[str, TopicCount] = {}
    for topic in (topic for copy in copies for topic in copy.topics()):
        before = together[topic.name].messages if topic.name in together else 0
        together[topic.name] = replace(topic, messages=before + topic.messages)
    return list(together.values())


class _Copy:
    """A fresh MCAP file with the records of another one that can be read."""

    def __init__(self, path: Path, old: Path, damage: list[str]) -> None:
        self.custom: dict[str, str] = {}
        self._file = BagFile(path)
        self._mcap = mcap_writer(self._file)
        self._mcap.start(profile=Profile.ROS2, library="fulmar")
        self._schemas: dict[int, tuple[int, str]] = {0: (0, "")}  # number there: number here and name
        self._channels: dict[int, tuple[int, str, Channel]] = {}
        self._old, self._damage = old, damage
        self._counts: Counter[int] = Counter()
        self._times = array("Q")

    def add(self, record: Schema | Channel | Message | Metadata | Attachment) -> None:
        if isinstance(record, Schema):
            if record.id not in self._schemas:
                number = self._mcap.register_schema(record.name, record.encoding, record.data)
                self._schemas[record.id] = (number, record.name)
        elif isinstance(record, Channel):
            self._add_channel(record)
        elif isinstance(record, Message):
            self._add_message(record)
        elif isinstance(record, Metadata):
            self._mcap.add_metadata(record.name, record.metadata)
            self.custom[record.name] = next(iter(record.metadata.values()), "")
        else:
            self._mcap.add_attachment(
                record.create_time, record.log_time, record.name, record.media_type, record.data
            )

    def _add_channel(self, channel: Channel) -> None:
        if channel.id not in self._channels and channel.schema_id in self._schemas:
            schema, type_name = self._schemas[channel.schema_id]
            channel.metadata[_QOS] = self._readable_qos(channel)
            number = self._mcap.register_channel(
                channel.topic, channel.message_encoding, schema, channel.metadata
            )
            self._channels[channel.id] = (number, type_name, channel)

    def _readable_qos(self, channel: Channel) -> str:
        """The text as it is, or none at all, which readers that stumble over such a text can do without."""
        text: str = channel.metadata.get(_QOS) or "[]"
        try:
            if isinstance(yaml_text.load(text), list):
                return text
            reason = "it is no list"
        except yaml_text.YamlError as error:
            reason = str(error)
        self._damage.append(f"{self._old}: the QoS of {channel.topic} cannot be read: {reason}")
        return "[]"

    def _add_message(self, message: Message) -> None:
        if message.channel_id in self._channels:
            number = self._channels[message.channel_id][0]
            self._mcap.add_message(
                number, message.log_time, message.data, message.publish_time, message.sequence
            )
            self._counts[message.channel_id] += 1
            self._times.append(message.log_time)
            if self._file.waiting > PIECE:
                self._file.flush()

    def finish(self) -> None:
        self._mcap.finish()
        self._file.finish()
        self._file.close()

    def span(self) -> BagSpan:
        return BagSpan(len(self._times), min(self._times, default=0), max(self._times, default=0))

    def topics(self) -> list[TopicCount]:
        return [
            TopicCount(
                channel.topic,
                type_name,
                channel.metadata.get("topic_type_hash", ""),
                yaml_text.load(channel.metadata[_QOS]),
                self._counts[number],
            )
            for number, (_, type_name, channel) in self._channels.items()
        ]
