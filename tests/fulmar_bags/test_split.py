"""A long recording is several files: each says everything about itself, together they are one bag."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
import yaml
from mcap.reader import make_reader
from rosbags.rosbag2 import Reader

from fulmar_bags.contents import open_bag
from fulmar_bags.mcap_file import BagPart
from fulmar_bags.mcap_records import bag_files
from fulmar_bags.recovery import recover
from fulmar_bags.writer import BagWriter
from tests.fulmar_bags.bags import INFO, START_NS, TOPIC, TYPE, word, words_by_mcap, words_by_rosbags

WORDS = [f"word {number}" for number in range(30)]


def split_bag(folder, **limits) -> BagWriter:
    """Ten words a second for three seconds."""
    bag = BagWriter(folder, run_info=INFO, attachments={"robot.yaml": b"name: it\n"}, **limits)
    bag.add_topic(TOPIC, TYPE, "stream")
    bag.tick(0.0)
    for number, text in enumerate(WORDS):
        bag.write(TOPIC, word(text), log_ns=START_NS + number * 100_000_000)
        bag.tick(number / 10)
    return bag


@pytest.fixture
def bag(tmp_path):
    split_bag(tmp_path / "bag", split_s=1.0).close()
    return tmp_path / "bag"


def test_a_file_of_a_second_is_followed_by_the_next(bag):
    assert [path.name for path in bag_files(bag)] == [f"bag_{number}.mcap" for number in range(3)]
    assert words_by_rosbags(bag) == words_by_mcap(bag) == WORDS


def test_a_file_that_has_grown_to_its_size_is_followed_by_the_next(tmp_path):
    split_bag(tmp_path / "bag", split_bytes=1.0).close()
    assert len(bag_files(tmp_path / "bag")) == 6  # looked at with each flush, twice a second
    assert words_by_rosbags(tmp_path / "bag") == WORDS


def test_without_limits_there_is_one_file(tmp_path):
    split_bag(tmp_path / "bag").close()
    assert len(bag_files(tmp_path / "bag")) == 1


def test_metadata_states_what_is_in_each_file_and_in_all(bag):
    reported = yaml.safe_load((bag / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert reported["relative_file_paths"] == [path.name for path in bag_files(bag)]
    assert sum(file["message_count"] for file in reported["files"]) == reported["message_count"] == 30
    first, second, _ = (file["starting_time"]["nanoseconds_since_epoch"] for file in reported["files"])
    assert first == reported["starting_time"]["nanoseconds_since_epoch"] == START_NS
    assert second == START_NS + reported["files"][0]["message_count"] * 100_000_000
    assert reported["duration"]["nanoseconds"] == 2_900_000_000
    with Reader(bag) as reader:
        assert (reader.message_count, reader.duration) == (30, 2_900_000_001)


def test_every_file_says_by_itself_what_made_it(bag):
    for path in bag_files(bag):
        with path.open("rb") as stream:
            reader = make_reader(stream)
            (run,) = (record for record in reader.iter_metadata() if record.name == "fulmar")
            assert json.loads(run.metadata["run"]) == INFO
            assert [(a.name, a.data) for a in reader.iter_attachments()] == [("robot.yaml", b"name: it\n")]
            (schema,) = reader.get_summary().schemas.values()
            assert (schema.name, schema.data) == (TYPE, b"string data\n")


def test_what_is_attached_late_is_in_this_file_and_the_following(tmp_path):
    bag = BagWriter(tmp_path / "bag", run_info=INFO)
    bag.add_topic(TOPIC, TYPE, "stream")
    bag.write(TOPIC, word("one"), log_ns=START_NS)
    bag.attach("late", b"here")
    bag.split()
    bag.close()
    for path in bag_files(tmp_path / "bag"):
        with path.open("rb") as stream:
            assert [a.name for a in make_reader(stream).iter_attachments()] == ["late"]


def test_a_bag_is_readable_at_every_moment_of_a_split(tmp_path):
    bag = split_bag(tmp_path / "bag", split_s=1.0)
    bag.flush()
    assert words_by_rosbags(tmp_path / "bag") == words_by_mcap(tmp_path / "bag") == WORDS
    bag.close()


def test_a_file_has_its_name_only_when_readers_can_open_it(tmp_path):
    """A recorder may be killed between the creation of the next file and its first flush."""
    part = BagPart(tmp_path / "bag_1.mcap")
    assert not list(tmp_path.glob("*.mcap"))
    part.flush()
    with (tmp_path / "bag_1.mcap").open("rb") as stream:
        assert not list(make_reader(stream).iter_messages())
    part.finish()
    assert [path.name for path in tmp_path.iterdir()] == ["bag_1.mcap"]


def test_the_tenth_file_comes_after_the_ninth(tmp_path):
    bag = BagWriter(tmp_path / "bag", run_info=INFO)
    bag.add_topic(TOPIC, TYPE, "stream")
    for number in range(12):
        bag.write(TOPIC, word(str(number)), log_ns=START_NS + number)
        bag.split()
    bag.close()
    assert words_by_mcap(tmp_path / "bag") == [str(number) for number in range(12)]


def test_recovery_keeps_whole_files_and_what_can_be_read_of_a_torn_one(bag):
    torn = bag_files(bag)[1]
    torn.write_bytes(torn.read_bytes()[: torn.stat().st_size // 2])
    bag_files(bag)[2].write_bytes(b"")
    (bag / "metadata.yaml").unlink()

    damage = recover(bag)

    assert any("bag_1" in line for line in damage)
    assert any("bag_2" in line for line in damage)
    kept = words_by_rosbags(bag)
    assert kept == WORDS[: len(kept)]
    assert len(kept) >= 10
    with Reader(bag) as reader:
        assert reader.message_count == len(kept)


def test_recovery_goes_on_past_a_file_that_is_no_bag_file(bag):
    bag_files(bag)[1].write_bytes(b"no bag at all")
    damage = recover(bag)
    assert len(damage) == 1 and "bag_1.mcap: this is no MCAP file" in damage[0]
    kept = words_by_rosbags(bag)
    assert (kept[0], kept[-1], kept) == (WORDS[0], WORDS[-1], [text for text in WORDS if text in kept])
    assert 15 <= len(kept) < len(WORDS)
    assert (bag / "bag_1.mcap.damaged").read_bytes() == b"no bag at all"


def test_a_new_name_is_on_the_disk_before_anything_else_counts_on_it(tmp_path, monkeypatch):
    done = []
    rename, fsync = os.rename, os.fsync
    monkeypatch.setattr(os, "rename", lambda old, new: (done.append(Path(new).name), rename(old, new)))
    monkeypatch.setattr(os, "fsync", lambda fd: (done.append(os.readlink(f"/proc/self/fd/{fd}")), fsync(fd)))
    folder = tmp_path / "bag"
    bag = BagWriter(folder, run_info=INFO)
    assert done[0] == str(tmp_path), "the name of the folder"
    assert done[done.index("bag_0.mcap") + 1] == str(folder)
    assert done[-1] == str(folder), "the name of metadata.yaml"
    bag.close()


def test_a_file_that_lost_its_name_with_the_power_is_read_and_recovered(bag):
    expected = words_by_mcap(bag)
    last = bag_files(bag)[-1]
    last.rename(f"{last}.begun")
    (bag / "bag_99.mcap.begun").touch()
    bag_now = open_bag(bag)
    assert bag_now.warnings == ()
    assert len(bag_now.topics[TOPIC]) == len(expected)
    assert recover(bag) == ()
    assert last in bag_files(bag)
    assert words_by_mcap(bag) == expected
