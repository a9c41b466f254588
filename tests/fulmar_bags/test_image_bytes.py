"""Images are read from their bytes as ROS reads them, and what is none is refused in words."""

from __future__ import annotations

import numpy as np
import pytest
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Image

from fulmar_bags.image_bytes import pixels_of, read_image
from fulmar_bags.reading_messages import READERS
from fulmar_core.robots.topics import CAMERA_DEPTH, CAMERA_IMAGE
from fulmar_core.wires.robot_name import PLAIN


def message(pixels, encoding="32FC1", *, step=0, frame="camera_optical_frame", swapped=0):
    height, width = pixels.shape[:2]
    row = pixels[0].nbytes
    rows = np.zeros((height, step or row), np.uint8)
    rows[:, :row] = pixels.reshape(height, -1).view(np.uint8)
    made = Image(height=height, width=width, encoding=encoding, is_bigendian=swapped, step=step or row)
    made.header.frame_id = frame
    made.header.stamp.sec, made.header.stamp.nanosec = 7, 300
    made.data.frombytes(rows.tobytes())
    return made


DEPTH = np.random.default_rng(1).uniform(0.1, 9.0, (5, 7)).astype(np.float32)
COLOURS = np.random.default_rng(1).integers(0, 255, (5, 7, 3), dtype=np.uint8)


@pytest.mark.parametrize("frame", ["", "a", "ab", "abc", "camera_optical_frame"])
@pytest.mark.parametrize(("pixels", "encoding"), [(DEPTH, "32FC1"), (COLOURS, "rgb8")])
def test_bytes_give_what_ros_reads(frame, pixels, encoding):
    found = read_image(serialize_message(message(pixels, encoding, frame=frame)))
    assert (found.header.stamp.sec, found.header.stamp.nanosec) == (7, 300)
    np.testing.assert_array_equal(pixels_of(found, encoding), pixels)


def test_rows_may_have_bytes_behind_their_pixels():
    found = read_image(serialize_message(message(DEPTH, step=32)))
    np.testing.assert_array_equal(pixels_of(found, "32FC1"), DEPTH)


def test_bytes_that_end_early_are_no_image():
    data = serialize_message(message(DEPTH))
    for length in range(0, len(data) - 4, 3):
        with pytest.raises(ValueError, match="no message of an image"):
            read_image(data[:length])


@pytest.mark.parametrize(
    ("made", "words"),
    [
        (message(DEPTH.astype(np.uint16), "16UC1"), "the image is '16UC1', must be '32FC1'"),
        (message(DEPTH, swapped=1), "the image is '32FC1', big-endian, must be '32FC1'"),
        (Image(encoding="32FC1"), "the image is damaged: 0 bytes for 0 × 0 px"),
        (Image(encoding="32FC1", height=5, width=7, step=28), "the image is damaged: 0 bytes for 7 × 5 px"),
    ],
)
def test_what_cannot_be_read_is_refused_in_words(made, words):
    assert pixels_of(read_image(serialize_message(made)), "32FC1").startswith(words)


def test_a_reading_of_depth_has_nothing_where_the_camera_could_not_measure():
    holes = DEPTH.copy()
    holes[2, 3] = np.nan
    reading = READERS[CAMERA_DEPTH](message(holes), PLAIN)
    assert reading.stamp_ns == 7_000_000_300
    assert reading.value[2, 3] == np.inf
    assert reading.value[2, 4] == DEPTH[2, 4]


def test_a_reading_of_colours_is_refused_where_its_order_is_another():
    assert READERS[CAMERA_IMAGE](message(COLOURS, "bgr8"), PLAIN) == "the image is 'bgr8', must be 'rgb8'"
    np.testing.assert_array_equal(READERS[CAMERA_IMAGE](message(COLOURS, "rgb8"), PLAIN).value, COLOURS)
