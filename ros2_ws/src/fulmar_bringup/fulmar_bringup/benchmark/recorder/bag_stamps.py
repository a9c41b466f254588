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


def count_by_rosbags(bag: Path) -> int:
    """Messages that the reader of `rosbags` finds."""
    with AnyReader([bag]) as reader:
        return sum(1 for _ in reader.messages())


def count_by_mcap(bag: Path) -> int:
    """Messages that the reader of `mcap` finds."""
    count = 0
    for path in bag_files(bag):
        with path.open("rb") as stream:
            count += sum(1 for _ in make_reader(stream).iter_messages())
    return count
