"""Frames in messages: what bags keep of them is as exact as said, and what cannot be read is refused by name."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_bags import frame_codecs as codecs
from fulmar_bags.frame_messages import COMPRESSED, IMAGE, packed, read_frame
from fulmar_core.config.errors import BagError
from tests.frames import BALL, COLOUR, DEPTH, ENCODINGS, IDS, SIZE, compressed, raw, read_back, scene


def frame_of(data, kind=IMAGE, topic="/robot/it"):
    return read_frame(data, kind, topic)


def packed_frames(topic, number=0):
    """What a bag keeps of a frame of the scene: pixels and format by the ending of the topic."""
    kept = packed(raw(scene(number)[topic], ENCODINGS[topic], 3.5), f"/robot/{topic}")
    found = {name: (frame_of(data, COMPRESSED, name), read_back(data)) for name, data in kept}
    return {name.removeprefix(f"/robot/{topic}"): pair for name, pair in found.items()}


def test_colours_are_kept_as_jpeg_that_looks_the_same():
    [(ending, (frame, message))] = packed_frames(COLOUR).items()
    assert (ending, message.format) == ("/compressed", "rgb8; jpeg compressed bgr8")
    assert message.header.frame_id == "camera_optical_frame"
    assert (frame.kind, frame.size, frame.stamp_ns) == ("colour", SIZE, 3_500_000_000)
    wrong = np.abs(frame.pixels.astype(float) - scene()[COLOUR])
    assert wrong.mean() < 4.0
    assert frame.pixels[24, 32, 0] > frame.pixels[24, 32, 2]  # red is still red


def test_segmentation_is_kept_to_the_bit():
    [(ending, (frame, message))] = packed_frames(IDS).items()
    assert (ending, message.format, frame.kind) == ("/compressed", "mono16; png compressed", "segmentation")
    np.testing.assert_array_equal(frame.pixels, scene()[IDS])
    assert frame.pixels.max() == BALL


def test_depth_is_kept_twice_for_two_viewers_and_nothing_stays_nothing():
    kept = packed_frames(DEPTH)
    assert {ending: message.format for ending, (_, message) in kept.items()} == {
        "/compressedDepth": "32FC1; compressedDepth png",
        "/compressed": "16UC1; png compressed",
    }
    depth = scene()[DEPTH]
    there = np.isfinite(depth)
    for ending, most in (("/compressedDepth", 1e-3 * depth[there]), ("/compressed", 5.1e-4)):
        frame = kept[ending][0]
        assert frame.kind == "depth"
        np.testing.assert_array_equal(np.isfinite(frame.pixels), there)
        assert (np.abs(frame.pixels[there] - depth[there]) <= most).all()


def test_packed_depth_is_within_a_thousandth_to_20_m_and_a_quarter_percent_at_50_m():
    depth = np.linspace(0.2, 100.0, 76800, dtype=np.float32).reshape(240, 320)
    found = codecs.read_compressed_depth(codecs.compressed_depth(depth), whole=False)
    wrong = np.abs(found - depth) / depth
    assert wrong[depth <= 20.0].max() <= 1e-3
    assert wrong[depth <= 50.0].max() <= 2.5e-3
    assert wrong.max() <= 5.1e-3


def test_what_is_no_distance_or_too_far_is_nothing():
    odd = np.array([[np.inf, np.nan, 0.0, -1.0, 100.5], [100.0, 65.6, 65.5, 0.01, 1e-4]], dtype=np.float32)
    found = codecs.read_compressed_depth(codecs.compressed_depth(odd), whole=False)
    assert np.isinf(found[0]).all()
    assert np.isfinite(found[1]).all()
    assert codecs.millimetres(odd).tolist() == [[0, 0, 0, 0, 0], [0, 0, 65500, 10, 0]]


def test_depth_of_others_counts_by_its_own_header():
    depth = np.array([[1.0, 5.0, 9.0, 11.0]], dtype=np.float32)
    data = codecs.compressed_depth(depth, depth_max=10.0)
    frame = frame_of(compressed(data, "32FC1; compressedDepth png"), COMPRESSED)
    np.testing.assert_allclose(frame.pixels[0, :3], depth[0, :3], rtol=1e-3)
    assert np.isinf(frame.pixels[0, 3])
    assert frame.reach == pytest.approx(10.0, rel=1e-5)


def test_whole_millimetres_are_metres_in_a_topic_of_depth_and_ids_elsewhere():
    numbers = np.array([[0, 1500, 65535]], dtype=np.uint16)
    depth = frame_of(raw(numbers, "16UC1"), topic="/their/aligned_depth/image_raw")
    assert (depth.kind, depth.pixels.tolist()) == ("depth", [[np.inf, 1.5, np.float32(65.535)]])
    assert frame_of(raw(numbers, "16UC1"), topic="/their/labels").kind == "segmentation"
    with_header = codecs.HEADER.pack(0, 0.0, 0.0) + codecs.png(numbers)
    old = frame_of(compressed(with_header, "16UC1; compressedDepth"), COMPRESSED)
    np.testing.assert_array_equal(old.pixels, depth.pixels)


@pytest.mark.parametrize(
    ("encoding", "pixel"),
    [
        ("rgb8", (9, 8, 7)),
        ("bgr8", (7, 8, 9)),
        ("rgba8", (9, 8, 7, 0)),
        ("bgra8", (7, 8, 9, 0)),
        ("8UC3", (7, 8, 9)),
    ],
)
def test_colours_of_every_order_are_the_same_colours(encoding, pixel):
    pixels = np.tile(np.array(pixel, dtype=np.uint8), (2, 3, 1))
    assert frame_of(raw(pixels, encoding, padding=5)).pixels[1, 2].tolist() == [9, 8, 7]


def test_greys_are_colours_and_big_numbers_are_read_whatever_their_byte_order():
    grey = np.array([[1, 2], [3, 250]], dtype=np.uint8)
    assert frame_of(raw(grey, "mono8")).pixels[1, 1].tolist() == [250, 250, 250]
    assert frame_of(compressed(codecs.png(grey), "mono8; png compressed"), COMPRESSED).kind == "colour"
    wide = np.array([[1, 300]], dtype=np.uint16)
    assert frame_of(raw(wide, "mono16", big=True)).pixels.tolist() == [[1, 300]]


@pytest.mark.parametrize(
    "form", ["", "jpeg", "bgr8; jpeg compressed bgr8", "bayer_rggb8; jpeg compressed bgr8"]
)
def test_a_jpeg_is_read_whatever_its_format_says_of_its_origin(form):
    frame = frame_of(compressed(codecs.jpeg(scene()[COLOUR]), form), COMPRESSED)
    assert (frame.kind, frame.size) == ("colour", SIZE)


GREY = np.zeros((4, 4), dtype=np.uint8)
REFUSED = {
    "a raw pattern of a sensor": (raw(GREY, "bayer_rggb8"), IMAGE, "'bayer_rggb8'.*image_proc"),
    "a packed one": (
        compressed(codecs.png(GREY), "bayer_rggb8; png compressed"),
        COMPRESSED,
        "'bayer_rggb8'",
    ),
    "an unknown encoding": (raw(GREY, "theirs"), IMAGE, "'theirs' of frames is not read.*rgb8"),
    "a length that is none": (raw(GREY, "mono8")[:-9], IMAGE, "no sensor_msgs/msg/Image"),
    "pixels that are missing": (raw(GREY, "rgb8"), IMAGE, "damaged: 4 × 4 of 'rgb8' with 4 bytes a row"),
    "an image that ends too early": (
        compressed(codecs.png(scene()[IDS])[:120], "png"),
        COMPRESSED,
        "damaged",
    ),
    "a film": (compressed(b"\0\0\0\1gH264", "h264"), COMPRESSED, "no JPEG, PNG, WebP or AVIF"),
    "another packing of depth": (
        compressed(b"123456789012345", "16UC1; compressedDepth rvl"),
        COMPRESSED,
        "'16UC1; compressedDepth rvl' of depth is not read",
    ),
    "a depth without its header": (compressed(b"short", "32FC1; compressedDepth png"), COMPRESSED, "no JPEG"),
    "a depth whose header is no numbers": (
        compressed(codecs.HEADER.pack(0, np.nan, 1.0) + codecs.png(GREY), "32FC1; compressedDepth png"),
        COMPRESSED,
        "header of the depth is damaged",
    ),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_cannot_be_read_is_refused_in_one_line_with_its_topic(what):
    data, kind, reason = REFUSED[what]
    with pytest.raises(BagError, match=reason) as refused:
        frame_of(data, kind, "/theirs/image")
    assert str(refused.value).startswith("/theirs/image: ")
    assert "\n" not in str(refused.value)
