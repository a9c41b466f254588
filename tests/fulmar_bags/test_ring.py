"""A ring keeps the last seconds in memory and writes them, and what follows, when a fault shows."""

from __future__ import annotations

import contextlib
import json
import resource
import signal

import pytest
import yaml
from rosbags.rosbag2 import Reader

from fulmar_bags.mcap_records import bag_files
from fulmar_bags.ring import BagRing
from fulmar_bags.writer import BagWriter
from fulmar_bags.writer_thread import BagThread
from fulmar_core.config.errors import BagError
from tests.fulmar_bags.bags import (
    INFO,
    START_NS,
    TOPIC,
    TYPE,
    publish_times,
    word,
    words_by_mcap,
    words_by_rosbags,
)

GOAL, S = "/robot/goal", 1_000_000_000


def new_bag(folder):
    bag = BagWriter(folder, run_info=INFO)
    bag.add_topic(TOPIC, TYPE, "stream")
    bag.add_topic(GOAL, TYPE, "latched")
    return bag


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "bag"


@pytest.fixture
def ring(folder):
    return make_ring(folder)


def make_ring(folder, **options):
    """Three seconds before a word that says fault, two after it."""
    return BagRing(
        lambda: new_bag(folder),
        before_s=3.0,
        after_s=2.0,
        latched={GOAL: 1},
        fault_in=lambda _topic, data: "it broke" if b"fault" in data else "",
        **options,
    )


def receive(ring, seconds, topic=TOPIC, text="word"):
    """One word a second, and a tick after each."""
    for second in seconds:
        ring.write(topic, word(f"{text} {second}"), log_ns=START_NS + second * S)
        with contextlib.suppress(BagError):
            ring.tick(second)


def test_without_a_fault_nothing_reaches_the_disk(ring, folder):
    receive(ring, range(100))
    ring.close()
    assert not folder.exists()
    assert ring.counts.messages == 0
    assert ring.kept_s == 3.0


def test_a_fault_writes_what_came_before_and_after_it(ring, folder):
    receive(ring, range(10))
    receive(ring, [10], text="fault")
    receive(ring, range(11, 20))
    ring.close()
    expected = ["word 7", "word 8", "word 9", "fault 10", "word 11", "word 12"]
    assert words_by_rosbags(folder) == words_by_mcap(folder) == expected
    with Reader(folder) as reader:
        assert reader.message_count == 6


def test_what_a_fault_writes_keeps_when_it_was_sent(ring, folder):
    def write(topic, text, second):
        ring.write(topic, word(text), log_ns=START_NS + second * S, publish_ns=START_NS + second * S - 7)
        ring.tick(second)

    write(GOAL, "goal", 0)  # older than the memory when the fault comes
    for second in range(1, 10):
        write(TOPIC, f"word {second}", second)
    write(TOPIC, "fault", 10)
    write(TOPIC, "word 11", 11)
    ring.close()
    sent = publish_times(folder)
    seconds = {"goal": 0, "word 7": 7, "word 8": 8, "word 9": 9, "fault": 10, "word 11": 11}
    assert sent == {text: START_NS + second * S - 7 for text, second in seconds.items()}


def test_a_fault_that_lasts_is_written_once_and_to_its_end(ring, folder):
    receive(ring, range(5))
    receive(ring, range(5, 9), text="fault")
    receive(ring, range(9, 20))
    ring.close()
    expected = ["word 2", "word 3", "word 4", *(f"fault {n}" for n in range(5, 9)), "word 9", "word 10"]
    assert words_by_rosbags(folder) == expected
    assert len(ring.faults) == 1


def test_each_fault_has_a_file_of_its_own_and_no_message_is_in_two(ring, folder):
    receive(ring, [0], text="fault")
    receive(ring, range(1, 30))
    receive(ring, [30], text="fault")
    receive(ring, range(31, 40))
    ring.close()
    assert len(bag_files(folder)) == 2
    words = words_by_mcap(folder)
    assert words == [
        *("fault 0", "word 1", "word 2"),
        *("word 27", "word 28", "word 29", "fault 30", "word 31", "word 32"),
    ]


def test_a_second_fault_soon_after_the_first_overlaps_nothing(ring, folder):
    receive(ring, [0], text="fault")
    receive(ring, range(1, 4))
    receive(ring, [4], text="fault")
    ring.close()
    assert words_by_mcap(folder) == ["fault 0", "word 1", "word 2", "word 3", "fault 4"]


def test_the_goal_is_written_however_old_it_is(ring, folder):
    receive(ring, [0, 1], topic=GOAL, text="goal")
    receive(ring, range(2, 100))
    receive(ring, [100], text="fault")
    ring.close()
    assert words_by_mcap(folder) == ["goal 1", "word 97", "word 98", "word 99", "fault 100"]
    with Reader(folder) as reader:
        assert reader.start_time == START_NS + 97 * S


def test_the_goal_is_in_the_file_of_every_fault(ring, folder):
    receive(ring, [0], topic=GOAL, text="goal")
    receive(ring, [1], text="fault")
    receive(ring, range(2, 30))
    receive(ring, [30], text="fault")
    ring.close()
    assert words_by_mcap(folder).count("goal 0") == 2


def test_the_bag_states_when_and_why_it_was_written(ring, folder):
    receive(ring, range(3))
    receive(ring, [3], text="fault")
    ring.close()
    reported = yaml.safe_load((folder / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert json.loads(reported["custom_data"]["fulmar_faults"]) == [
        {"time_ns": START_NS + 3 * S, "reason": "it broke"}
    ]


def test_a_memory_that_is_too_small_keeps_the_newest_and_says_so(folder):
    ring = make_ring(folder, max_bytes=2 * len(word("word 0")))
    assert not ring.cut_short
    receive(ring, range(3))
    assert ring.cut_short
    receive(ring, [3], text="fault")
    ring.close()
    assert words_by_mcap(folder) == ["word 1", "word 2", "fault 3"]


@pytest.fixture
def full_disk():
    """No file may hold a byte; gives what makes room."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    old = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, before[1]))
    make_room = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, before)  # noqa: E731
    yield make_room
    make_room()
    signal.signal(signal.SIGXFSZ, old)


def test_a_fault_on_a_full_disk_is_written_as_soon_as_there_is_room(ring, folder, full_disk):
    receive(ring, range(10))
    receive(ring, [10], text="fault")
    receive(ring, range(11, 13))
    assert list(folder.iterdir()) == []
    assert (ring.counts.messages, ring.counts.on_disk) == (6, 0)
    full_disk()
    receive(ring, range(13, 20))
    receive(ring, [20], text="fault")
    ring.close()
    first = ["word 7", "word 8", "word 9", "fault 10", "word 11", "word 12", "word 13"]
    assert words_by_mcap(folder) == [*first, "word 17", "word 18", "word 19", "fault 20"]
    assert [fault["time_ns"] for fault in ring.faults] == [START_NS + 10 * S, START_NS + 20 * S]


def test_a_second_fault_on_a_full_disk_waits_for_room_too(ring, folder, tmp_path):
    receive(ring, [0], text="fault")
    receive(ring, range(1, 10))
    blocked = folder / "bag_1.mcap.begun"
    blocked.touch()  # the next file cannot be created
    with pytest.raises(OSError, match="exists"):
        receive(ring, [10], text="fault")
    blocked.unlink()
    receive(ring, [11])
    ring.close()
    assert words_by_mcap(folder)[-5:] == ["word 7", "word 8", "word 9", "fault 10", "word 11"]


def test_a_fault_that_was_never_written_counts_as_lost(ring, folder, full_disk):
    reported = []
    thread = BagThread(ring, on_error=reported.append)
    thread.put(TOPIC, word("word 0"), START_NS)
    thread.put(TOPIC, word("fault 1"), START_NS + S)
    account = thread.stop()
    assert (account.received, account.recorded, account.lost) == (2, 0, 2)
    assert "cannot write a bag here" in account.problem
    assert len(reported) == 1
