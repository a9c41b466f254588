"""Chunks of other writers that were spoilt, or that lie about their size."""

from __future__ import annotations

import pytest
from mcap.records import Message
from mcap.writer import CompressionType, Writer

from fulmar_bags import stored_bytes
from fulmar_bags.mcap_records import read_records


def written(path, compression, *contents):
    """A file with a chunk for each of these messages."""
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=1, compression=compression)
        writer.start()
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        channel = writer.register_channel("/word", "cdr", schema)
        for number, content in enumerate(contents):
            writer.add_message(channel, number, content, number)
        writer.finish()
    return path


def messages(path):
    """Contents of the messages that can be read, and the damage."""
    damage: list[str] = []
    return [each.data for each in read_records(path, damage) if isinstance(each, Message)], damage


def test_a_flipped_bit_costs_its_chunk_and_becomes_no_message(tmp_path):
    path = written(tmp_path / "bag.mcap", CompressionType.NONE, b"first", b"second", b"third")
    path.write_bytes(path.read_bytes().replace(b"second", b"sekond"))
    found, damage = messages(path)
    assert found == [b"first", b"third"]
    assert len(damage) == 1 and "is damaged and was left out" in damage[0]


@pytest.mark.parametrize("most_at_once", [1 << 20, 1000])
def test_a_chunk_that_unpacks_to_far_more_than_it_is_is_left_out(tmp_path, monkeypatch, most_at_once):
    monkeypatch.setattr(stored_bytes, "UNPACK_LEAST", 10_000)
    monkeypatch.setattr(stored_bytes, "UNPACK_RATIO", 100)
    monkeypatch.setattr("fulmar_bags.mcap_records.MOST_CHUNK", most_at_once)
    path = written(tmp_path / "bag.mcap", CompressionType.ZSTD, b"first", bytes(500_000), b"third")
    found, damage = messages(path)
    assert found == [b"first", b"third"]
    assert len(damage) == 1 and "is damaged and was left out" in damage[0]


def test_a_bag_is_read_up_to_wherever_it_is_cut(tmp_path):
    contents = [b"first", b"second", b"third"]
    path = written(tmp_path / "bag.mcap", CompressionType.ZSTD, *contents)
    whole, cut = path.read_bytes(), tmp_path / "cut.mcap"
    counts = []
    for length in range(8, len(whole), 7):
        cut.write_bytes(whole[:length])
        found, _ = messages(cut)
        assert found == contents[: len(found)]
        counts.append(len(found))
    assert counts == sorted(counts) and {*counts} == {0, 1, 2, 3}
