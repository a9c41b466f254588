"""Bags with images, of Fulmar's and of other programs: `info` knows them, and no command stumbles over them."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from fulmar_bags.contents import open_bag
from fulmar_bags.decode import odometries
from fulmar_bags.frame_codecs import jpeg, read_image
from fulmar_bags.frame_messages import COMPRESSED, IMAGE
from fulmar_core.robots.topics import ODOMETRY
from tests.bags_with_frames import COUNT, packed_messages, theirs, with_images
from tests.frames import COLOUR, DEPTH, IDS, compressed, raw, read_back, scene, write_messages
from tests.fulmar_cli.bag_commands import LQR, answer, ask


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
    [line] = [line for line in left_out if line.startswith(f"/robot/{COLOUR}/compressed: data")]
    assert line.endswith("Use --to frames.")


def test_raw_images_of_one_size_are_arrays_in_numpy(tmp_path):
    bag = write_messages(
        tmp_path / "bag", {"/it": (IMAGE, [raw(scene(i)[COLOUR], "rgb8") for i in range(3)])}
    )
    answer("export", bag, "--to", "npz", "--out", tmp_path / "out.npz")
    found = np.load(tmp_path / "out.npz")["it/data"].reshape(3, 48, 64, 3)
    np.testing.assert_array_equal(found[2], scene(2)[COLOUR])


def rows_of(folder):
    with (folder / "frames.csv").open() as stream:
        return list(csv.DictReader(stream))


def test_images_are_exported_as_files_with_the_time_and_the_place_of_each(tmp_path):
    bag = with_images(open_bag(LQR), tmp_path / "bag", packed_messages(4, "/floating_platform"))
    found = answer("export", bag, "--to", "frames", "--out", tmp_path / "out")
    assert (found["files"], found["left_out"]) == ([str(tmp_path / "out" / "frames.csv")], [])
    rows = rows_of(tmp_path / "out")
    assert [row["camera"] for row in rows] == [
        name for name in ("camera", "camera_depth", "camera_segmentation") for _ in range(4)
    ]
    seen = odometries(open_bag(bag).of(ODOMETRY))
    for number, row in enumerate(rows[:4]):
        assert int(row["stamp_ns"]) == 1_000_000_000 + number * 100_000_000
        nearest = int(np.argmin(np.abs(seen.stamp_ns - int(row["stamp_ns"]))))
        assert [float(row[key]) for key in ("x", "y", "qw")] == seen.pose[nearest, [0, 1, 6]].tolist()
    files = {row["file"]: read_image((tmp_path / "out" / row["file"]).read_bytes()) for row in rows}
    np.testing.assert_array_equal(files["camera_segmentation/000003.png"], scene(3)[IDS])
    depth = scene(2)[DEPTH]
    there = np.isfinite(depth)
    whole = files["camera_depth/000002.png"]
    np.testing.assert_array_equal(whole > 0, there)
    np.testing.assert_allclose(whole[there], 1000.0 * depth[there], rtol=1e-3, atol=0.5)
    jpeg_file = (tmp_path / "out" / "camera/000001.jpg").read_bytes()
    message = open_bag(bag).topics[f"/floating_platform/{COLOUR}/compressed"].data[1]
    assert jpeg_file == bytes(read_back(message).data)


def test_images_of_others_are_exported_and_what_cannot_be_read_or_is_damaged_is_named(tmp_path):
    messages = theirs()
    images = [compressed(data, "jpeg") for data in (jpeg(scene()[COLOUR]), b"torn")]
    messages["/left/compressed"] = (COMPRESSED, images)
    bag = write_messages(tmp_path / "bag", messages)
    left_out = answer("export", bag, "--to", "frames", "--out", tmp_path / "out")["left_out"]
    assert "encoding 'bayer_rggb8'" in left_out[0]
    assert left_out[1:] == ["/left/compressed: 1 images are damaged."]
    rows = rows_of(tmp_path / "out")
    assert {row["camera"] for row in rows} == {"front", "front_depth", "left"}
    assert {row["x"] for row in rows} == {""}
    np.testing.assert_array_equal(
        read_image((tmp_path / "out/front/000005.png").read_bytes()), scene(5)[COLOUR][:, :, ::-1]
    )


def test_a_bag_without_images_has_none_to_export(tmp_path):
    done = ask("export", LQR, "--to", "frames", "--out", tmp_path / "out")
    assert "holds no image to export" in str(done.exception)
    assert not (tmp_path / "out").exists()
