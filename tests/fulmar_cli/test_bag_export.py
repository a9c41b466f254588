"""`fulmar bag export`: what a table cannot hold is named, and nothing is written of nothing."""

from __future__ import annotations

import csv
import json

import numpy as np
import pyarrow.parquet as parquet
import pytest
from rosbags.rosbag2.enums import StoragePlugin
from typer.testing import CliRunner

from fulmar_bags.contents import open_bag
from fulmar_bags.decode import joint_vectors, odometries
from fulmar_bags.frame_codecs import read_image
from fulmar_bags.frame_messages import COMPRESSED, IMAGE
from fulmar_bags.lerobot import _table
from fulmar_bags.writer import BagWriter
from fulmar_cli.main import app
from fulmar_core.config.errors import BagError
from fulmar_core.config.paths import OWN_FOLDERS, config_path
from fulmar_core.robots.topics import ACTION, COMMAND, OBSERVATION, ODOMETRY
from tests.bags_with_frames import packed_messages, with_images
from tests.foreign_bag import write_foreign
from tests.frames import COLOUR, DEPTH, IDS, compressed, raw, scene
from tests.fulmar_cli.bag_commands import BAGS, POLICY, answer, ask
from tests.fulmar_cli.test_bag_diff import SCAN, bag_of, scan


def export(bag, *words):
    return CliRunner().invoke(app, ["bag", "export", str(bag), *map(str, words)])


@pytest.mark.parametrize("form", ["csv", "npz"])
def test_a_bag_without_messages_is_not_exported(tmp_path, form):
    bag = bag_of(tmp_path / "bag", SCAN)
    done = export(bag, "--to", form, "--out", tmp_path / "out")
    assert isinstance(done.exception, BagError)
    assert not (tmp_path / "out").exists()
    assert not (tmp_path / "out.npz").exists()


def test_a_long_array_is_named_where_a_table_leaves_it_out_and_is_kept_in_numpy(tmp_path):
    ranges = np.linspace(1.0, 2.0, 360)
    bag = bag_of(tmp_path / "bag", SCAN, scan(ranges), scan(ranges + 1.0))
    table = export(bag, "--to", "csv", "--out", tmp_path / "csv")
    assert "left out: /floating_platform/it: ranges" in table.output
    assert "ranges" not in (tmp_path / "csv" / "floating_platform.it.csv").read_text().splitlines()[0]
    arrays = export(bag, "--to", "npz", "--out", tmp_path / "bag.npz")
    assert "left out" not in arrays.output
    kept = np.load(tmp_path / "bag.npz")["floating_platform/it/ranges"]
    np.testing.assert_array_equal(kept, np.stack([ranges, ranges + 1.0]).astype(np.float32))


def test_an_array_whose_length_changes_is_named(tmp_path):
    bag = bag_of(tmp_path / "bag", SCAN, scan(np.zeros(100)), scan(np.zeros(101)))
    assert "its length changes" in export(bag, "--to", "npz", "--out", tmp_path / "bag.npz").output


def test_messages_that_cannot_be_read_are_counted(tmp_path):
    bag = bag_of(tmp_path / "bag", SCAN, scan(np.zeros(3)), scan(np.zeros(3))[:20])
    done = export(bag, "--out", tmp_path / "csv")
    assert "1 messages cannot be read as sensor_msgs/msg/LaserScan" in done.output


def copy_of(source, folder, *, keep=lambda name, index: True, attachments=None, **info):
    """A bag with the messages of another one that are kept."""
    bag = BagWriter(folder, run_info={**source.info, **info}, attachments=attachments)
    for topic in source.topics.values():
        bag.add_topic(topic.name, topic.type, "stream")
    every = sorted(
        (log, topic.name, i) for topic in source.topics.values() for i, log in enumerate(topic.log_ns)
    )
    for log, name, index in every:
        if keep(name, index):
            bag.write(name, source.topics[name].data[index], log_ns=log)
    bag.close()
    return folder


def info_of(dataset):
    return json.loads((dataset / "meta/info.json").read_text())


def episodes_of(dataset):
    return parquet.read_table(dataset / "meta/episodes/chunk-000/file-000.parquet").to_pydict()


def test_a_bag_with_a_hole_gives_two_episodes(tmp_path):
    source = open_bag(POLICY)
    hole = source.of(OBSERVATION).name, source.of(ACTION).name, source.of(COMMAND).name
    bag = copy_of(source, tmp_path / "bag", keep=lambda name, index: name not in hole or not 30 <= index < 40)
    done = export(bag, "--to", "lerobot", "--out", tmp_path / "set")
    assert "its 2 parts are episodes of their own" in done.output
    assert episodes_of(tmp_path / "set")["length"] == [30, 60]


def test_a_dataset_names_the_robot_that_only_its_bag_knows(tmp_path, monkeypatch):
    monkeypatch.delenv(OWN_FOLDERS, raising=False)
    text = config_path("robots", "floating_platform").read_text()
    carried = {"robot.yaml": text.replace("name: floating_platform", "name: mybot").encode()}
    bag = copy_of(
        open_bag(POLICY), tmp_path / "bag", attachments=carried, robot="mybot", name="floating_platform"
    )
    done = export(bag, "--to", "lerobot", "--out", tmp_path / "set")
    assert done.exit_code == 0, done.exception
    info = info_of(tmp_path / "set")
    assert info["robot_type"] == "mybot"
    assert info["features"]["action"]["names"] == [f"thruster_{number}" for number in range(1, 9)]


def test_a_dataset_that_grows_beyond_a_file_goes_on_in_the_next_one(tmp_path, monkeypatch):
    monkeypatch.setattr("fulmar_bags.lerobot.FILE_MB", 0)
    monkeypatch.setattr("fulmar_bags.lerobot.CHUNK", 2)
    answer("export", POLICY, POLICY, POLICY, "--to", "lerobot", "--out", tmp_path / "set")
    data = tmp_path / "set/data"
    files = [data / "chunk-000/file-000.parquet", data / "chunk-000/file-001.parquet"]
    files += [data / "chunk-001/file-000.parquet"]
    assert sorted(data.glob("*/*")) == files
    assert [parquet.read_table(file)["episode_index"].unique().to_pylist() for file in files] == [
        [0],
        [1],
        [2],
    ]
    rows = episodes_of(tmp_path / "set")
    assert (rows["data/chunk_index"], rows["data/file_index"]) == ([0, 0, 1], [0, 1, 0])


def test_a_vector_of_one_number_is_a_number_in_the_table():
    one, two = np.ones((3, 1), dtype=np.float32), np.ones((3, 2), dtype=np.float32)
    table = _table({"action": one, "observation.state": two})
    assert table["action"].to_pylist() == [1.0, 1.0, 1.0]
    assert table["observation.state"].to_pylist() == [[1.0, 1.0]] * 3


def test_a_bag_of_others_is_no_dataset_and_no_option_is_named_that_there_is_not(tmp_path):
    bag = write_foreign(tmp_path / "bag", StoragePlugin.MCAP, count=5)
    reported = str(export(bag, "--to", "lerobot", "--out", tmp_path / "set").exception)
    assert "others recorded it" in reported
    assert "--robot" not in reported


def test_tables_hold_every_number(tmp_path):
    answer("export", POLICY, "--to", "csv", "--out", tmp_path / "csv")
    with (tmp_path / "csv" / "floating_platform.odom.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    seen = odometries(open_bag(POLICY).of(ODOMETRY))
    assert [float(row["pose.pose.position.x"]) for row in rows] == seen.pose[:, 0].tolist()
    answer("export", POLICY, "--to", "npz", "--out", tmp_path / "bag.npz")
    arrays = np.load(tmp_path / "bag.npz", allow_pickle=False)
    np.testing.assert_array_equal(arrays["floating_platform/odom/pose.pose.position.x"], seen.pose[:, 0])
    np.testing.assert_array_equal(arrays["floating_platform/odom/stamp_ns"], seen.stamp_ns)


def test_a_dataset_holds_an_episode_for_each_bag_and_a_frame_for_each_step(tmp_path):
    answer("export", POLICY, POLICY, "--to", "lerobot", "--out", tmp_path / "set")
    info = info_of(tmp_path / "set")
    assert info["codebase_version"] == "v3.0"
    assert (info["total_episodes"], info["total_frames"], info["fps"]) == (2, 200, 5)
    path = info["data_path"].format(chunk_index=0, file_index=0)
    table = parquet.read_table(tmp_path / "set" / path)
    assert set(table.column_names) == set(info["features"])
    recorded = joint_vectors(open_bag(POLICY).of(ACTION), "effort").values
    np.testing.assert_array_equal(np.array(table["action"].to_pylist()), np.tile(recorded, (2, 1)))
    assert table["index"].to_pylist() == list(range(200))
    assert table["next.done"].to_pylist() == 2 * ([False] * 99 + [True])
    rows = episodes_of(tmp_path / "set")
    assert rows["length"] == [100, 100]
    assert (rows["dataset_from_index"], rows["dataset_to_index"]) == ([0, 100], [100, 200])
    refused = ask(
        "export",
        POLICY,
        BAGS / "turtlebot2_go_to_position_policy",
        "--to",
        "lerobot",
        "--out",
        tmp_path / "mixed",
    )
    assert "another kind" in str(refused.exception)


CAMERA = "/floating_platform"


def dataset_of(tmp_path, messages, *bags, hz=5.0):
    sources = [
        with_images(open_bag(bag), tmp_path / f"bag_{i}", messages, hz=hz) for i, bag in enumerate(bags)
    ]
    done = CliRunner().invoke(
        app, ["bag", "export", *map(str, sources), "--to", "lerobot", "--out", str(tmp_path / "set")]
    )
    return done, tmp_path / "set"


def film_of(dataset, key="observation.images.camera"):
    import av

    with av.open(str(dataset / f"videos/{key}/chunk-000/file-000.mp4")) as film:
        return [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]


def test_a_dataset_takes_the_images_of_each_step_along(tmp_path):
    done, dataset = dataset_of(tmp_path, packed_messages(20, CAMERA, hz=5.0), POLICY)
    assert done.exit_code == 0, done.exception
    assert "depth is in millimetres up to 32.767 m" in done.output
    features = info_of(dataset)["features"]
    colour, depth, ids = (f"observation.images.camera{more}" for more in ("", "_depth", "_segmentation"))
    assert (features[colour]["dtype"], features[colour]["shape"]) == ("video", [48, 64, 3])
    assert features[colour]["info"]["video.codec"] == "h264"
    film, row = film_of(dataset), episodes_of(dataset)
    assert len(film) == row["length"][0] == 100
    assert row[f"videos/{colour}/to_timestamp"] == [20.0]
    table = parquet.read_table(dataset / "data/chunk-000/file-000.parquet").to_pydict()
    for step in (0, 7, 50):
        pixels = scene(min(step, 19))
        assert np.abs(film[step] - pixels[COLOUR].astype(float)).mean() < 8.0
        np.testing.assert_array_equal(read_image(table[ids][step]["bytes"]), pixels[IDS])
        whole = read_image(table[depth][step]["bytes"])
        np.testing.assert_allclose(
            whole, np.where(pixels[IDS] > 0, 1000.0 * pixels[DEPTH], 0.0), rtol=1e-3, atol=0.5
        )
    stats = json.loads((dataset / "meta/stats.json").read_text())
    assert np.shape(stats[colour]["mean"]) == (3, 1, 1)
    assert stats[depth]["count"] == [100]


def test_steps_before_the_first_image_are_left_out_and_a_torn_image_is_as_the_one_before(tmp_path):
    topic = f"{CAMERA}/{COLOUR}/compressed"
    images = packed_messages(20, CAMERA, hz=5.0)[topic][1][4:]
    images[3] = compressed(b"torn", "jpeg", 1.0 + 7 / 5.0)
    done, dataset = dataset_of(tmp_path, {topic: (COMPRESSED, images)}, POLICY)
    assert "bag 1: 4 steps before the first image are left out." in done.output
    film = film_of(dataset)
    assert len(film) == 96
    np.testing.assert_allclose(film[3].astype(float), film[2], atol=12.0)


def test_bags_with_other_cameras_are_exported_apart_and_images_that_cannot_be_read_are_named(tmp_path):
    plain = raw(np.zeros((4, 4), np.uint8), "bayer_rggb8")
    done, dataset = dataset_of(tmp_path, {f"{CAMERA}/rear/image_raw": (IMAGE, [plain])}, POLICY)
    assert "left out: /floating_platform/rear/image_raw: encoding 'bayer_rggb8'" in done.output
    assert not (dataset / "videos").exists()
    with_them = with_images(open_bag(POLICY), tmp_path / "with", packed_messages(3, CAMERA))
    done = export(with_them, POLICY, "--to", "lerobot", "--out", tmp_path / "other")
    assert "bag 2 has no camera, the first one observation.images.camera (colour, 64 × 48)" in str(
        done.exception
    )
