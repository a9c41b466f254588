"""A full or slow disk never holds up who records; what it costs is declared and counted."""

from __future__ import annotations

import errno
import json
import os
import random
import subprocess
import threading
import time

import pytest
import yaml

from fulmar_bags.writer import BagWriter
from fulmar_bags.writer_thread import BagThread
from tests.fulmar_bags.bags import INFO, START_NS, TOPIC, TYPE, word, words_by_mcap, words_by_rosbags


class Disk:
    """A bag on a disk that may be slow or full, as a test says."""

    def __init__(self, bag: BagWriter) -> None:
        self._bag, self.full = bag, False
        self.moves, self.waited_for = threading.Event(), threading.Event()
        self.moves.set()

    def __getattr__(self, name: str) -> object:
        return getattr(self._bag, name)

    @property
    def waiting(self) -> int:
        return self._bag.waiting + (self._unwritten() if self.full else 0)

    def _unwritten(self) -> int:
        return self._bag.counts.messages - self._bag.counts.on_disk

    def tick(self, now: float) -> None:
        if not self.moves.is_set():
            self.waited_for.set()
        self.moves.wait()
        if self.full:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        self._bag.tick(now)


@pytest.fixture
def disk(tmp_path):
    bag = BagWriter(tmp_path / "bag", run_info=INFO)
    bag.add_topic(TOPIC, TYPE, "stream")
    return Disk(bag)


def wait_until(true) -> None:
    until = time.monotonic() + 20.0
    while not true():
        assert time.monotonic() < until
        time.sleep(0.01)


def offer(thread, count, first=0):
    began = time.monotonic()
    for number in range(first, first + count):
        thread.put(TOPIC, word(f"word {number}"), START_NS + number)
    return time.monotonic() - began


def test_a_disk_that_stands_still_holds_nobody_up_and_loses_nothing(disk, tmp_path):
    thread = BagThread(disk, on_error=pytest.fail)
    disk.moves.clear()
    offer(thread, 1)
    assert disk.waited_for.wait(20.0)
    assert offer(thread, 1000, first=1) < 2.0
    assert thread.account().recorded == 0
    time.sleep(0.2)
    disk.moves.set()
    account = thread.stop()
    assert (account.received, account.recorded, account.lost) == (1001, 1001, 0)
    assert account.slowest_write_s >= 0.2
    assert words_by_rosbags(tmp_path / "bag") == [f"word {number}" for number in range(1001)]


def test_what_finds_no_room_in_memory_is_dropped_counted_by_topic_and_reported_once(disk):
    reported = []
    thread = BagThread(disk, on_error=reported.append, max_waiting=100 * len(word("word 10")))
    disk.moves.clear()
    assert disk.waited_for.wait(20.0)
    offer(thread, 1000, first=10)
    disk.moves.set()
    account = thread.stop()
    assert account.dropped == {TOPIC: account.received - account.recorded}
    assert 850 < account.dropped[TOPIC] < 950
    assert len(reported) == 1
    assert "further messages are dropped" in reported[0]


def test_a_full_disk_is_declared_and_what_waited_is_written_when_there_is_room(disk, tmp_path):
    reported = []
    thread = BagThread(disk, on_error=reported.append)
    disk.full = True
    offer(thread, 100)
    wait_until(lambda: thread.account().problem)
    assert thread.account().problem == "the disk is full: what comes waits in memory"
    disk.full = False
    wait_until(lambda: thread.account().recorded == 100)
    wait_until(lambda: not thread.account().problem)
    assert thread.stop().lost == 0
    assert len(reported) == 1
    assert "Make room" in reported[0]
    assert words_by_mcap(tmp_path / "bag") == [f"word {number}" for number in range(100)]


def test_the_bag_states_what_became_of_every_message(disk, tmp_path):
    thread = BagThread(disk, on_error=lambda _: None, max_waiting=100)
    disk.moves.clear()
    assert disk.waited_for.wait(20.0)
    offer(thread, 50)
    disk.moves.set()
    account = thread.stop()
    reported = yaml.safe_load((tmp_path / "bag" / "metadata.yaml").read_text())
    recording = json.loads(reported["rosbag2_bagfile_information"]["custom_data"]["fulmar_recording"])
    assert recording == {"complete": True, "received": 50, "dropped": account.dropped}


def test_a_thread_that_died_is_said_and_what_it_left_behind_is_lost(disk):
    """Whatever a bag raises that is no matter of the disk."""
    write, reported = disk.write, []

    def fail_at_ten(topic, data, **times):
        if data == word("word 10"):
            raise ValueError("no such thing")
        write(topic, data, **times)

    disk.write = fail_at_ten
    thread = BagThread(disk, on_error=reported.append)
    offer(thread, 50)
    wait_until(lambda: reported)
    offer(thread, 50, first=50)
    account = thread.stop()
    assert reported == [account.problem] == ["the recording broke off: ValueError: no such thing"]
    assert (account.received, account.complete) == (100, False)
    assert account.recorded + account.lost == 100
    assert thread.stop() == account


@pytest.mark.skipif(
    os.getuid() != 0, reason="only root may mount a small disk; the tests above refuse writes instead"
)
def test_on_a_disk_of_256_kb_the_bag_stays_readable_and_goes_on_when_there_is_room(tmp_path):
    """The real thing: a file system without room."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", str(disk)]
    mounted = subprocess.run(mount, check=False, capture_output=True, text=True)
    if mounted.returncode:
        pytest.skip(
            f"no small disk may be mounted here; the tests above refuse writes instead: {mounted.stderr}"
        )
    try:
        bag = BagWriter(disk / "bag", run_info=INFO)
        bag.add_topic(TOPIC, TYPE, "stream")
        reported = []
        thread = BagThread(bag, on_error=reported.append)
        ballast = disk / "ballast"
        thread.put(TOPIC, word("word 0"), START_NS)
        wait_until(lambda: thread.account().recorded == 1)
        ballast.write_bytes(bytes(200_000))
        for number in range(1, 101):
            text = random.Random(number).randbytes(1000).hex()  # does not compress
            thread.put(TOPIC, word(text), START_NS + number)
        wait_until(lambda: "the disk is full" in thread.account().problem)
        assert words_by_rosbags(disk / "bag") == words_by_mcap(disk / "bag") == ["word 0"]
        ballast.unlink()
        account = thread.stop()
        assert account.lost == 0
        assert len(words_by_rosbags(disk / "bag")) == 101
        assert any("the disk is full" in line for line in reported)
    finally:
        subprocess.run(["umount", "--lazy", str(disk)], check=True)
