"""Stamps of the messages of a bag, without decoding them."""

from __future__ import annotations

import struct
from collections import defaultdict
from pathlib import Path

from mcap.reader import make_reader
from mcap.records import Channel, Message
from rosbags.highlevel import AnyReader

from fulmar_ros.bag_records import bag_files, read_records

STAMP = struct.Struct("<iI")  # seconds and nanoseconds of a header, which such a message begins with
CDR_HEAD = 4  # bytes before the message
NS = 1_000_000_000


def stamps_by_topic(bag: Path) -> dict[str, list[int]]:
    """Stamps of every message [ns], by topic, as they were recorded; of topics without a header they mean nothing."""
    stamps: dict[str, list[int]] = defaultdict(list)
    for path in bag_files(bag):
        topics: dict[int, str] = {}
        for record in read_records(path, []):
            if isinstance(record, Channel):
                topics[record.id] = record.topic
            elif isinstance(record, Message) and len(record.data) >= CDR_HEAD + STAMP.size:
                seconds, rest = STAMP.unpack_from(record.data, CDR_HEAD)
                stamps[topics[record.channel_id]].append(seconds * NS + rest)
    return stamps


def opens(bag: Path) -> bool:
    """Whether the readers of `rosbags` and of `mcap` open a bag and find the same number of messages."""
    try:
        return _count_by_rosbags(bag) == _count_by_mcap(bag)
    except Exception:  # noqa: BLE001 - whatever a reader raises is the finding
        return False


def _count_by_rosbags(bag: Path) -> int:
    with AnyReader([bag]) as reader:
        return sum(1 for _ in reader.messages())


def _count_by_mcap(bag: Path) -> int:
    count = 0
    for path in bag_files(bag):
        with path.open("rb") as stream:
            count += sum(1 for _ in make_reader(stream).iter_messages())
    return count
