"""Stamps of the messages of a bag, and whether the readers of others open it."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

from mcap.reader import make_reader
from rosbags.highlevel import AnyReader

from fulmar_bags.contents import open_bag
from fulmar_bags.decode import stamps_ns
from fulmar_bags.mcap_records import bag_files


def stamps_by_topic(bag: Path) -> dict[str, list[int]]:
    """Stamps of every message [ns], by topic, as they were recorded; none where there is no message or no header."""
    stamps = {name: stamps_ns(topic) for name, topic in open_bag(bag).topics.items() if len(topic)}
    return defaultdict(list, {name: found.tolist() for name, found in stamps.items() if found is not None})


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
