"""A recorder process beside a camera: in lock step it keeps one frame of each kind for each period, packed."""

from __future__ import annotations

import os
import signal
import time

import numpy as np
import pytest
from rclpy.duration import Duration
from sensor_msgs.msg import Image

from fulmar_bags.contents import open_bag
from fulmar_bags.frame_topics import cameras
from fulmar_core.robots.topics import CAMERA_COMPRESSED, CAMERA_IMAGES
from fulmar_ros.qos import publish_patiently, publisher_qos
from tests.frames import ENCODINGS, scene
from tests.ros.recorder import ROBOT, wait_for


def image(pixels: np.ndarray, encoding: str, number: int) -> Image:
    height, width = pixels.shape[:2]
    message = Image(height=height, width=width, encoding=encoding, step=pixels.nbytes // height)
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(
        1_000_000_000 + number * 100_000_000, 10**9
    )
    message.data = pixels.tobytes()
    return message


def camera(node):
    found = {
        wire: node.create_publisher(Image, wire.name, publisher_qos(wire, lockstep=True))
        for wire in CAMERA_IMAGES
    }
    wait_for(lambda: all(each.get_subscription_count() for each in found.values()))
    time.sleep(0.5)  # a publisher knows of a match a moment before the subscriber does
    return found


@pytest.mark.slow
def test_frames_of_lock_step_that_come_faster_than_they_are_packed_are_all_kept_once(record, node):
    recorder = record("lossless:=true")
    recorder.wait_until_recording()
    sent = camera(node)
    pixels = scene(size=(320, 240))
    count = 150  # 100 MB, more than may wait
    for number in range(count):
        for wire, publisher in sent.items():
            message = image(pixels[wire.name], ENCODINGS[wire.name], number)
            publish_patiently(publisher, message)
            if number % 50 == 0:  # as where a period is repeated
                publish_patiently(publisher, message)
    for publisher in sent.values():
        assert publisher.wait_for_all_acked(Duration(seconds=20.0))
    code, _, err = recorder.end(signal.SIGINT)
    assert (code, err) == (0, "")
    bag = open_bag(recorder.directory)
    for wire in CAMERA_COMPRESSED:
        assert len(bag.topics[f"{ROBOT}/{wire.name}"]) == count, wire.name
    seen = cameras(bag.topics.values())
    assert [each.kind for each in seen] == ["colour", "depth", "segmentation"]
    for each in seen:
        assert each.first.size == (320, 240)
        np.testing.assert_array_equal(each.taken_ns, 10**9 + np.arange(count) * 10**8)
    assert bag.size < 0.05 * count * sum(each.nbytes for each in pixels.values())


def test_raw_frames_are_kept_to_the_byte_where_they_are_asked_for(record, node):
    recorder = record("frames:=raw")
    recorder.wait_until_recording()
    sent = camera(node)
    pixels = scene()
    for wire, publisher in sent.items():
        publisher.publish(image(pixels[wire.name], ENCODINGS[wire.name], 0))
        assert publisher.wait_for_all_acked(Duration(seconds=5.0))
    assert recorder.end(signal.SIGINT)[0] == os.EX_OK
    for each in cameras(open_bag(recorder.directory).topics.values()):
        name = each.topic.name.removeprefix(f"{ROBOT}/")
        np.testing.assert_array_equal(each.frame(0).pixels, pixels[name])
