"""The next goal ends a bag and begins another one, which starts with the latched messages."""

from __future__ import annotations

import pytest

from fulmar_bags.per_goal import BagPerGoal
from fulmar_bags.writer import BagWriter
from fulmar_core.config.errors import BagError
from tests.fulmar_bags.bags import INFO, START_NS, TOPIC, TYPE, publish_times, word, words_by_rosbags

GOAL, OBSTACLES, S = "/robot/goal", "/robot/obstacles", 1_000_000_000


class Recording:
    """A bag for each goal, on a disk that refuses a bag while `refuses` is set."""

    def __init__(self, folder):
        self.folder, self.refuses = folder, False
        self.bag = BagPerGoal(self._open, goals={GOAL}, latched={GOAL: 1, OBSTACLES: 1})
        self.second = 0

    def _open(self, number):
        if self.refuses:
            raise BagError("no room")
        bag = BagWriter(self.folder / f"goal_{number}", run_info=INFO)
        for topic, delivery in ((TOPIC, "stream"), (GOAL, "latched"), (OBSTACLES, "latched")):
            bag.add_topic(topic, TYPE, delivery)
        return bag

    def take(self, *texts, topic=TOPIC):
        """A word a second, and a tick after each."""
        for text in texts:
            self.second += 1
            self.bag.write(topic, word(text), log_ns=START_NS + self.second * S)
            self.bag.tick(self.second)

    def words(self):
        """What each bag holds."""
        self.bag.close()
        return [words_by_rosbags(folder) for folder in sorted(self.folder.iterdir())]


@pytest.fixture
def recording(tmp_path):
    return Recording(tmp_path)


def test_each_goal_has_its_bag_and_every_message_is_in_one(recording):
    recording.take("wall", topic=OBSTACLES)
    recording.take("a")
    recording.take("first", topic=GOAL)
    recording.take("b")
    recording.take("first", topic=GOAL)  # repeated for a late subscriber
    recording.take("second", topic=GOAL)
    recording.take("c")
    first, second = recording.words()
    assert sorted(first) == sorted(["wall", "a", "first", "b", "first", "second"])
    assert sorted(second) == sorted(["wall", "second", "c"])
    assert (recording.bag.counts.messages, recording.bag.counts.on_disk) == (7, 7)
    assert (recording.bag.counts.files, recording.bag.waiting) == (2, 0)


def test_a_goal_that_begins_a_bag_keeps_when_it_was_sent(recording):
    for second, text in enumerate(("first", "second"), start=1):
        recording.bag.write(
            GOAL, word(text), log_ns=START_NS + second * S, publish_ns=START_NS + second * S - 7
        )
        recording.bag.tick(second)
    recording.bag.close()
    first, second = (publish_times(folder) for folder in sorted(recording.folder.iterdir()))
    assert first == {"first": START_NS + S - 7, "second": START_NS + 2 * S - 7}
    assert second == {"second": START_NS + 2 * S - 7}


def test_a_disk_that_takes_no_new_bag_loses_nothing(recording):
    recording.take("first", topic=GOAL)
    recording.refuses = True
    with pytest.raises(BagError, match="no room"):
        recording.take("second", topic=GOAL)
    recording.refuses = False
    recording.take("a", "b")
    assert recording.words() == [["first", "second", "a"], ["second", "b"]]
    assert recording.bag.counts.messages == recording.bag.counts.on_disk == 4


def test_what_is_attached_late_is_in_every_bag_that_follows(recording):
    recording.bag.attach("code", b"1")
    recording.take("first", "second", topic=GOAL)
    recording.bag.close()
    for folder in recording.folder.iterdir():
        (file,) = folder.glob("*.mcap")
        assert b"code" in file.read_bytes()


def test_a_bag_that_cannot_be_closed_at_once_is_closed_later(recording, monkeypatch):
    close, refusals = BagWriter.close, [OSError(28, "no room")]

    def full_once(bag):
        if refusals:
            raise refusals.pop()
        close(bag)

    monkeypatch.setattr(BagWriter, "close", full_once)
    recording.take("first", topic=GOAL)
    with pytest.raises(OSError, match="no room"):
        recording.take("second", topic=GOAL)
    recording.take("a")
    recording.take("third", topic=GOAL)
    assert recording.words() == [["first", "second"], ["second", "a", "third"], ["third"]]
