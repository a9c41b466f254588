"""Bags with images, of Fulmar's and of other programs: `info` knows them, and no command stumbles over them."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_bags.frame_codecs import compressed_depth, jpeg
from fulmar_bags.frame_messages import COMPRESSED, IMAGE, packed
from tests.frames import COLOUR, DEPTH, ENCODINGS, IDS, compressed, raw, scene, write_messages
from tests.fulmar_cli.bag_commands import answer, ask

COUNT = 20


def packed_messages(count=COUNT, robot="/robot"):
    """What a recorder keeps of a camera, by topic."""
    found: dict[str, tuple[str, list[bytes]]] = {}
    for number in range(count):
        for name, pixels in scene(number).items():
            for topic, data in packed(raw(pixels, ENCODINGS[name], 1.0 + 0.1 * number), f"{robot}/{name}"):
                found.setdefault(topic, (COMPRESSED, []))[1].append(data)
    return found


def theirs():
    """Topics of other programs: raw colours, depth to 10 m as image_transport packs it, and a raw pattern."""
    pixels = [scene(number) for number in range(COUNT)]
    depth = [compressed_depth(each[DEPTH], depth_max=10.0) for each in pixels]
    return {
        "/front/image_color": (
            IMAGE,
            [raw(each[COLOUR], "bgr8", 1.0 + 0.1 * i) for i, each in enumerate(pixels)],
        ),
        "/front/depth/compressedDepth": (
            COMPRESSED,
            [compressed(data, "32FC1; compressedDepth png", 1.0 + 0.1 * i) for i, data in enumerate(depth)],
        ),
        "/rear/image_raw": (IMAGE, [raw(each[COLOUR][:, :, 0], "bayer_rggb8") for each in pixels]),
    }


def frames_of(bag):
    return {topic["name"]: topic for topic in answer("info", bag)["topics"] if topic["frames"]}


def test_info_knows_rate_size_count_and_kind_of_the_images_of_a_recorded_camera(tmp_path):
    bag = write_messages(tmp_path / "bag", packed_messages())
    found = frames_of(bag)
    kinds = {name: topic["frames"]["kind"] for name, topic in found.items()}
    assert kinds == {
        f"/robot/{COLOUR}/compressed": "colour",
        f"/robot/{DEPTH}/compressed": "depth",
        f"/robot/{DEPTH}/compressedDepth": "depth",
        f"/robot/{IDS}/compressed": "segmentation",
    }
    for topic in found.values():
        assert (topic["count"], topic["gaps"], topic["dropped"]) == (COUNT, 0, 0)
        assert topic["rate_hz"] == pytest.approx(10.0)
        assert (topic["frames"]["width"], topic["frames"]["height"]) == (64, 48)
        assert topic["frames"]["mean_bytes"] * COUNT == pytest.approx(topic["bytes"])
    text = ask("info", bag).output
    assert f"/robot/{COLOUR}/compressed: 20 images of 64 × 48, colour, 10.00 Hz, 0.0" in text
    assert "depth, up to 100 m, 10.00 Hz" in text


def test_info_says_how_far_the_depth_of_others_reaches_and_names_an_encoding_that_nobody_can_show(tmp_path):
    bag = write_messages(tmp_path / "bag", theirs())
    found = frames_of(bag)
    assert found["/front/depth/compressedDepth"]["frames"]["reach_m"] == pytest.approx(10.0, rel=1e-5)
    done = ask("info", bag)
    assert done.exit_code == 0
    assert (
        "images that cannot be shown: /rear/image_raw: encoding 'bayer_rggb8' of frames is not read"
        in done.output
    )
    assert "depth, up to 10 m" in done.output


def test_the_first_images_of_a_topic_may_be_damaged(tmp_path):
    whole, torn = (compressed(data, "jpeg") for data in (jpeg(scene()[COLOUR]), b"torn"))
    bag = write_messages(
        tmp_path / "bag", {"/it": (COMPRESSED, [torn, torn, whole]), "/bad": (COMPRESSED, [torn])}
    )
    found = frames_of(bag)
    assert found["/it"]["frames"]["width"] == 64
    assert found["/bad"]["frames"] == {"problem": "/bad: the image is no JPEG, PNG, WebP or AVIF (4 bytes)."}


def test_bags_with_images_are_compared_by_their_bytes(tmp_path):
    one = write_messages(tmp_path / "one", packed_messages(3))
    same = write_messages(tmp_path / "same", packed_messages(3))
    assert answer("diff", one, same)["same"]
    changed = packed_messages(3)
    changed[f"/robot/{IDS}/compressed"][1][2] = changed[f"/robot/{IDS}/compressed"][1][1]
    other = write_messages(tmp_path / "other", changed)
    assert not answer("diff", one, other)["same"]


@pytest.mark.parametrize("form", ["csv", "npz"])
def test_tables_name_the_images_that_they_leave_out(tmp_path, form):
    bag = write_messages(tmp_path / "bag", packed_messages(3))
    left_out = answer("export", bag, "--to", form, "--out", tmp_path / "out")["left_out"]
    assert any(f"/robot/{COLOUR}/compressed: data" in line for line in left_out)


def test_raw_images_of_one_size_are_arrays_in_numpy(tmp_path):
    bag = write_messages(
        tmp_path / "bag", {"/it": (IMAGE, [raw(scene(i)[COLOUR], "rgb8") for i in range(3)])}
    )
    answer("export", bag, "--to", "npz", "--out", tmp_path / "out.npz")
    found = np.load(tmp_path / "out.npz")["it/data"].reshape(3, 48, 64, 3)
    np.testing.assert_array_equal(found[2], scene(2)[COLOUR])
