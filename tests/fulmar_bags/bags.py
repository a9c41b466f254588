"""Small bags of numbered words, and what two readers find in them."""

from __future__ import annotations

from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

from fulmar_bags.mcap_records import bag_files
from fulmar_bags.message_types import type_store

TOPIC, TYPE = "/robot/word", "std_msgs/msg/String"
INFO = {"robot": "floating_platform", "goal": [0.0, 1.0, 90.0]}
START_NS = 1_700_000_000_000_000_000


def word(text: str) -> bytes:
    return bytes(type_store().serialize_cdr(type_store().types[TYPE](text), TYPE))


def publish_times(folder: Path) -> dict[str, int]:
    """When each word of a bag was sent [ns]."""
    found = {}
    for path in bag_files(folder):
        with path.open("rb") as stream:
            reader = make_reader(stream, decoder_factories=[DecoderFactory()])
            found |= {word.data: each.publish_time for _, _, each, word in reader.iter_decoded_messages()}
    return found


def words_by_rosbags(folder: Path) -> list[str]:
    with AnyReader([folder]) as reader:
        return [reader.deserialize(raw, c.msgtype).data for c, _, raw in reader.messages()]


def words_by_mcap(folder: Path, reader_class: object = make_reader) -> list[str]:
    """Of all files of the bag, in their order."""
    words = []
    for path in bag_files(folder):
        with path.open("rb") as stream:
            reader = reader_class(stream, decoder_factories=[DecoderFactory()])
            words += [message.data for *_, message in reader.iter_decoded_messages()]
    return words
