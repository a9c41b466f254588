"""A recorder that died is followed by another one, which goes on in the same bag."""

from __future__ import annotations

import json
import time

import pytest
from rosbags.rosbag2 import Reader

from fulmar_bags.contents import open_bag as open_recorded
from fulmar_bags.interrupted_bag import interrupted_bag
from fulmar_bags.mcap_file import BEGUN
from fulmar_bags.recovery import recover
from fulmar_bags.writer_thread import RECORDING, BagThread
from fulmar_core.config.errors import BagError
from tests.fulmar_bags.test_writer import START_NS, TOPIC, open_bag, word, words_by_rosbags, write_words


def interrupted(folder) -> None:
    """A bag of five words in two files, whose writer has died."""
    bag = open_bag(folder)
    write_words(bag, 0, 3)
    bag.split()
    write_words(bag, 3, 2)
    bag.flush()


def test_a_bag_goes_on_in_a_further_file_and_loses_nothing(tmp_path):
    interrupted(tmp_path / "bag")
    before = {file: file.read_bytes() for file in (tmp_path / "bag").glob("*.mcap")}
    bag = open_bag(tmp_path / "bag", resume=True)
    write_words(bag, 10, 4)
    bag.close()
    assert all(file.read_bytes() == data for file, data in before.items())
    assert [file.name for file in open_recorded(tmp_path / "bag").files] == [
        f"bag_{n}.mcap" for n in range(3)
    ]
    assert words_by_rosbags(tmp_path / "bag") == [f"word {n}" for n in (*range(5), *range(10, 14))]
    with Reader(tmp_path / "bag") as reader:
        assert reader.message_count == 9
        assert reader.start_time == START_NS
    topic = open_recorded(tmp_path / "bag").topics[TOPIC]
    assert list(topic.sequence) == list(range(1, 10))
    assert recover(tmp_path / "bag") == ()
    assert len(words_by_rosbags(tmp_path / "bag")) == 9


def test_counts_of_the_recorder_that_died_are_added_in_the_bag(tmp_path):
    interrupted(tmp_path / "bag")
    thread = BagThread(
        open_bag(tmp_path / "bag", resume=True),
        on_error=pytest.fail,
        before={"complete": False, "received": 7, "dropped": {TOPIC: 2}},
    )
    thread.put(TOPIC, word("one"), START_NS + 1_000_000_000)
    account = thread.stop()
    assert (account.received, account.recorded) == (1, 1)
    said = open_recorded(tmp_path / "bag").recording
    assert said == {"complete": True, "received": 8, "dropped": {TOPIC: 2}, "interruptions": 1}
    assert RECORDING not in json.dumps(open_recorded(tmp_path / "bag").info)


def test_a_file_that_never_got_its_name_is_not_in_the_way(tmp_path):
    interrupted(tmp_path / "bag")
    (tmp_path / "bag" / f"bag_2.mcap{BEGUN}").touch()
    assert interrupted_bag(tmp_path / "bag").next_number == 3
    bag = open_bag(tmp_path / "bag", resume=True)
    write_words(bag, 10, 1)
    bag.close()
    assert len(words_by_rosbags(tmp_path / "bag")) == 6


def test_a_bag_whose_metadata_is_gone_goes_on_all_the_same(tmp_path):
    interrupted(tmp_path / "bag")
    (tmp_path / "bag" / "metadata.yaml").write_text("{")
    bag = open_bag(tmp_path / "bag", resume=True)
    write_words(bag, 10, 1)
    bag.close()
    assert len(words_by_rosbags(tmp_path / "bag")) == 6


def test_what_was_written_after_the_last_metadata_counts_as_recorded(tmp_path):
    assert interrupted_bag(tmp_path / "bag").last_ns == 0
    before_ns = time.time_ns() - 1_000_000_000  # the clock of files is coarse
    interrupted(tmp_path / "bag")
    assert interrupted_bag(tmp_path / "bag").last_ns < before_ns  # the log time of the last message
    (tmp_path / "bag" / "metadata.yaml").write_text("{}")
    assert interrupted_bag(tmp_path / "bag").last_ns >= before_ns


def test_a_bag_is_never_continued_unasked(tmp_path):
    interrupted(tmp_path / "bag")
    with pytest.raises(BagError, match="never overwritten"):
        open_bag(tmp_path / "bag")
