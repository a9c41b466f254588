"""A recorder keeps frames packed: none is lost, nothing waits for it, and what cannot be packed stays as it is."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

from fulmar_bags.contents import open_bag
from fulmar_bags.frame_messages import COMPRESSED, IMAGE, PACKINGS, Frame, read_frame
from fulmar_bags.frame_recording import PackedFrames
from fulmar_bags.frame_topics import PACKED_ENDINGS
from fulmar_bags.ring import BagRing
from fulmar_bags.writer import BagWriter
from fulmar_bags.writer_thread import BagThread
from fulmar_core.robots.topics import CAMERA_COMPRESSED, CAMERA_IMAGES
from tests.frames import COLOUR, ENCODINGS, IDS, NS, START_NS, compressed, raw, scene

TOPICS = [f"/robot/{name}" for name in ENCODINGS]


def bag_for_frames(folder):
    bag = BagWriter(folder, run_info={})
    for topic in TOPICS:
        bag.add_topic(topic, IMAGE, "stream")
        for ending in PACKED_ENDINGS:
            bag.add_topic(topic + ending, COMPRESSED, "stream")
    return bag


def put_frames(put, count, first=0):
    for number in range(first, first + count):
        for name, pixels in scene(number % 20).items():
            put(f"/robot/{name}", raw(pixels, ENCODINGS[name], 0.1 * number), START_NS + number * NS // 10)


def frames_in(folder) -> dict[str, list[Frame]]:
    """By the name of the topic below the robot's."""
    return {
        name.removeprefix("/robot/"): [read_frame(data, topic.type, name) for data in topic.data]
        for name, topic in open_bag(folder).topics.items()
        if len(topic)
    }


def test_the_topics_of_a_camera_have_a_wire_for_each_packing():
    kinds = ("colour", "depth", "segmentation")
    wanted = {
        image.name + ending: form
        for image, kind in zip(CAMERA_IMAGES, kinds, strict=True)
        for ending, form, _ in PACKINGS[kind]
    }
    assert {wire.name for wire in CAMERA_COMPRESSED} == set(wanted)
    assert all(f"`{wanted[wire.name]}`" in wire.content for wire in CAMERA_COMPRESSED)


def test_every_frame_is_kept_packed_with_its_stamp_and_takes_less_room(tmp_path):
    thread = BagThread(
        PackedFrames(bag_for_frames(tmp_path / "bag"), TOPICS, pytest.fail), on_error=pytest.fail
    )
    put_frames(thread.put, 30)
    account = thread.stop()
    assert (account.received, account.recorded, account.lost) == (90, 120, 0)
    found = frames_in(tmp_path / "bag")
    assert set(found) == {wire.name for wire in CAMERA_COMPRESSED}
    for frames in found.values():
        assert [frame.stamp_ns for frame in frames] == [number * NS // 10 for number in range(30)]
    np.testing.assert_array_equal(found[f"{IDS}/compressed"][7].pixels, scene(7)[IDS])
    bare = 30 * sum(len(raw(pixels, ENCODINGS[name])) for name, pixels in scene().items())
    assert account.size < bare / 4


def test_a_patient_recorder_loses_no_frame_where_memory_is_small(tmp_path):
    bag = PackedFrames(bag_for_frames(tmp_path / "bag"), TOPICS, pytest.fail)
    thread = BagThread(bag, on_error=pytest.fail, max_waiting=50_000, patient=True)
    put_frames(thread.put, 40)
    account = thread.stop()
    assert (account.received, account.lost) == (120, 0)
    assert len(frames_in(tmp_path / "bag")[f"{COLOUR}/compressed"]) == 40


def test_who_ends_a_recorder_sees_that_a_frame_waits_for_room(tmp_path):
    bag, held = bag_for_frames(tmp_path / "bag"), threading.Event()
    wait = bag.tick
    bag.tick = lambda now: (held.wait(20.0), wait(now))
    thread = BagThread(bag, on_error=pytest.fail, max_waiting=10_000, patient=True)
    put_frames(thread.put, 1)
    waits = threading.Thread(target=put_frames, args=(thread.put, 1, 1))
    waits.start()
    until = time.monotonic() + 20.0
    while thread.received < 4 and time.monotonic() < until:
        time.sleep(0.01)
    assert thread.is_full
    held.set()
    waits.join(20.0)
    assert thread.stop().lost == 0


def test_in_real_time_nobody_waits_and_what_finds_no_room_is_counted_by_its_topic(tmp_path):
    reported = []
    bag = PackedFrames(bag_for_frames(tmp_path / "bag"), TOPICS, pytest.fail)
    thread = BagThread(bag, on_error=reported.append, max_waiting=50_000)
    messages = [raw(scene()[COLOUR], "rgb8")] * 200
    began = time.monotonic()
    for number, data in enumerate(messages):
        thread.put(TOPICS[0], data, START_NS + number)
    assert time.monotonic() - began < 0.5
    account = thread.stop()
    assert account.dropped[TOPICS[0]] > 0
    assert account.recorded + account.lost == 200
    assert len(reported) == 1


def test_a_frame_that_cannot_be_packed_stays_raw_and_is_reported_once(tmp_path):
    reported = []
    bag = PackedFrames(bag_for_frames(tmp_path / "bag"), TOPICS, reported.append)
    data = raw(np.zeros((4, 4), np.uint8), "bayer_rggb8")
    for number in range(3):
        bag.write(TOPICS[0], data, log_ns=START_NS + number)
    bag.close()
    assert list(open_bag(tmp_path / "bag").topics[TOPICS[0]].data) == [data] * 3
    [line] = reported
    assert "bayer_rggb8" in line
    assert "stay as they are" in line


def test_a_frame_too_wide_for_its_codec_stays_raw_and_the_recording_goes_on(tmp_path):
    reported = []
    thread = BagThread(
        PackedFrames(bag_for_frames(tmp_path / "bag"), TOPICS, reported.append), on_error=pytest.fail
    )
    data = raw(np.zeros((1, 70_000), np.uint8), "mono8")
    for number in range(3):
        thread.put(f"/robot/{COLOUR}", data, START_NS + number)
    thread.put(f"/robot/{COLOUR}", raw(scene()[COLOUR], "rgb8"), START_NS + 3)
    account = thread.stop()
    assert (account.recorded, account.lost, account.complete) == (4, 0, True)
    topics = open_bag(tmp_path / "bag").topics
    assert list(topics[f"/robot/{COLOUR}"].data) == [data] * 3
    assert len(topics[f"/robot/{COLOUR}/compressed"]) == 1
    [line] = reported
    assert line.startswith(f"/robot/{COLOUR}: a frame cannot be packed: ")
    assert line.endswith(" Its frames stay as they are.")
    assert "\n" not in line


def test_of_a_camera_that_packs_its_frames_itself_there_are_none_twice(tmp_path):
    bag = PackedFrames(bag_for_frames(tmp_path / "bag"), TOPICS, pytest.fail)
    theirs = compressed(b"theirs", "rgb8; jpeg compressed bgr8")
    for number in range(2):
        bag.write(f"{TOPICS[0]}/compressed", theirs, log_ns=START_NS + number)
        bag.write(TOPICS[0], raw(scene()[COLOUR], "rgb8"), log_ns=START_NS + number)
    bag.close()
    assert list(open_bag(tmp_path / "bag").topics[f"{TOPICS[0]}/compressed"].data) == [theirs] * 2


def test_a_ring_keeps_packed_frames_so_that_more_time_fits_into_its_memory(tmp_path):
    ring = BagRing(
        lambda: bag_for_frames(tmp_path / "bag"),
        before_s=60.0,
        after_s=0.0,
        latched={},
        fault_in=lambda topic, _: "fault" if topic == "/fault" else "",
        max_bytes=100_000,
    )
    bag = PackedFrames(ring, TOPICS, pytest.fail)
    put_frames(lambda topic, data, log_ns: bag.write(topic, data, log_ns=log_ns), 20)
    assert not ring.cut_short  # raw frames are 460 kB
    assert ring.kept_s == pytest.approx(1.9)


def test_a_torn_bag_has_its_frames_up_to_the_tear(tmp_path):
    bag = PackedFrames(bag_for_frames(tmp_path / "bag"), TOPICS, pytest.fail)
    write = lambda topic, data, log_ns: bag.write(topic, data, log_ns=log_ns)  # noqa: E731
    put_frames(write, 10)
    bag.tick(0.0)
    bag.tick(1.0)
    put_frames(write, 10, first=10)
    bag.close()
    [file] = (tmp_path / "bag").glob("*.mcap")
    whole = frames_in(tmp_path / "bag")[f"{IDS}/compressed"]
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    kept = frames_in(tmp_path / "bag")[f"{IDS}/compressed"]
    assert 10 <= len(kept) < 20
    np.testing.assert_array_equal(kept[9].pixels, whole[9].pixels)
