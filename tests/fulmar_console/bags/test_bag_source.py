"""Bags are read once into tracks, marks and health, as the console's page plays them."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from rosbags.rosbag2.enums import StoragePlugin

from fulmar_bags.contents import open_bag
from fulmar_bags.decode import odometries
from fulmar_console.bags import recording as module
from fulmar_console.bags.bag_source import BagSource
from fulmar_console.bags.paths import bags_of
from fulmar_console.bags.recorded_robot import robots_of
from fulmar_console.bags.recording import as_json, read_recording
from fulmar_console.exports.played import played_robots
from fulmar_core.config.errors import BagError
from tests.foreign_bag import write_foreign
from tests.fulmar_cli.bag_commands import BAGS, LQR, file_of
from tests.synthetic_run import Plan, write_run


def read(*paths):
    return read_recording([path for each in paths for path in bags_of(each)], "run", lambda *_: None)


def served(*paths):
    source = BagSource(paths)
    source.start()
    source._thread.join(60.0)
    return source


def test_a_track_has_the_poses_of_the_odometry_at_25_hz():
    recording = read(LQR)
    (robot,) = played_robots(recording)
    bag = open_bag(LQR)
    seen = odometries(bag.odometry())
    assert recording.document["hz"] == 25.0
    np.testing.assert_allclose(np.diff(robot.column("t")), 0.04, atol=1e-5)
    at = np.argmin(np.abs(robot.column("t") - (seen.stamp_ns[40] - seen.stamp_ns[0]) / 1e9))
    np.testing.assert_allclose(robot.poses[at], seen.pose[40], atol=0.05)
    assert robot.record["info"]["type"] == "floating_platform"
    assert len(robot.shares) == 8


def test_a_run_has_its_goal_and_a_falling_error(tmp_path):
    recording = read(write_run(tmp_path / "run", Plan(duration_s=25.0)))
    kinds = [mark["kind"] for mark in recording.document["marks"]]
    assert kinds.count("goal") == 1
    (robot,) = played_robots(recording)
    error = robot.column("error")
    assert error[10] > 2.0 > 0.1 > error[-10]
    assert 0.0 <= robot.table[:, robot.fields.index("share:thruster_1")].max() <= 1.0
    json.loads(as_json(recording.document))


def test_a_robot_with_an_origin_is_shown_in_the_map_with_its_goal_and_the_same_error(monkeypatch):
    (plain,) = played_robots(read(LQR))
    turned = (10.0, 20.0, 0.0, 0.0, 0.0, 0.5**0.5, 0.5**0.5)  # a quarter turn to the left

    def with_origin(bag):
        return [replace(each, info={**each.info, "origin": turned}) for each in robots_of(bag)]

    monkeypatch.setattr(module, "robots_of", with_origin)
    (robot,) = played_robots(read(LQR))
    x, y, z = plain.poses[:, :3].T
    np.testing.assert_allclose(robot.poses[:, :3], np.column_stack((10.0 - y, 20.0 + x, z)), atol=1e-5)
    np.testing.assert_allclose(robot.column("error"), plain.column("error"), atol=1e-5)
    for (_, goal), (_, before) in zip(robot.goals(), plain.goals(), strict=True):
        assert goal[:2] == pytest.approx([10.0 - before[1], 20.0 + before[0]], abs=1e-4)


def test_a_silent_controller_shows_as_a_fault(tmp_path):
    recording = read(write_run(tmp_path / "run", Plan(duration_s=20.0, silence_s=(5.0, 8.0))))
    marks = [mark for mark in recording.document["marks"] if mark["kind"] in ("fault", "intervention")]
    assert any(4.5 < mark["t_s"] < 9.0 for mark in marks), recording.document["marks"]


@pytest.mark.parametrize("storage", [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def test_bags_of_other_programs_show_a_plain_robot(tmp_path, storage):
    recording = read(write_foreign(tmp_path / "theirs", storage))
    (robot,) = played_robots(recording)
    assert robot.record["info"] is None and len(robot.table) > 90


def test_a_folder_of_bags_is_one_recording(tmp_path):
    for name in ("one", "two"):
        shutil.copytree(LQR, tmp_path / "system" / name)
    recording = read(tmp_path / "system")
    assert [robot["index"] for robot in recording.document["robots"]] == [0, 1]


def test_a_torn_bag_opens_as_far_as_it_goes(tmp_path):
    shutil.copytree(LQR, tmp_path / "torn")
    file = file_of(tmp_path / "torn")
    file.write_bytes(file.read_bytes()[: int(0.7 * file.stat().st_size)])
    source = served(tmp_path / "torn")
    if source._problem is None:
        assert json.loads(source.file("/bags/0.json"))["notes"]
    else:
        assert "torn" in str(source._problem)


def test_a_bag_without_a_robot_is_one_line(tmp_path):
    folder = write_foreign(tmp_path / "two", StoragePlugin.MCAP, topic="/words_only", count=0)
    with pytest.raises(BagError, match="holds no robot"):
        read(folder)
    source = served(folder)
    with pytest.raises(BagError, match="holds no robot"):
        source.version()


def test_a_wrong_name_gets_the_nearest_one(tmp_path):
    shutil.copytree(LQR, tmp_path / "first")
    with pytest.raises(BagError, match="Did you mean 'first'"):
        bags_of(tmp_path / "frist")
    (tmp_path / "empty").mkdir()
    with pytest.raises(BagError, match="holds no bag: it is empty"):
        bags_of(tmp_path / "empty")


def test_the_source_serves_documents_columns_and_nothing_else():
    source = served(LQR, BAGS / "turtlebot2_go_to_position_policy")
    assert [bag["path"] for bag in source.hello()["bags"]] == ["/bags/0", "/bags/1"]
    document = json.loads(source.file("/bags/1.json"))
    track = document["tracks"][0]
    assert document["ready"] and len(source.file("/bags/1.bin")) == 4 * track["count"] * len(track["fields"])
    for path in (
        "/bags/2.json",
        "/bags/0",
        "/bags/../0.json",
        "/bags/0/image/0/0/0",
        "/bags/0/image/x/0/0",
        "/etc",
    ):
        assert source.file(path) is None
    answers = []
    source.do({"do": "goal"}, lambda *answer: answers.append(answer), "page 1")
    assert answers[0][0] is False


def test_progress_is_said_until_a_bag_is_read():
    source = BagSource([LQR])
    assert json.loads(source.file("/bags/0.json")) == {
        "ready": False, "name": LQR.name, "share": 0.0, "words": "waiting",
    }  # fmt: skip
    assert source.file("/bags/0.bin") is None
