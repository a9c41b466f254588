"""Bags are read alike whoever recorded them: in one file or several, compressed or not, with or without stamps."""

from __future__ import annotations

import itertools
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2.enums import CompressionMode, StoragePlugin

from fulmar_bags.contents import open_bag
from fulmar_bags.decode import joint_vectors, messages, odometries, stamp_of
from fulmar_core.robots.topics import ACTION, ODOMETRY
from tests.foreign_bag import write_foreign
from tests.fulmar_cli.bag_commands import BAGS, POLICY, answer, ask, file_of

STORAGES = [StoragePlugin.MCAP, StoragePlugin.SQLITE3]


def test_every_message_of_the_reference_bags_is_what_its_schema_says():
    for folder in BAGS.iterdir():
        assert not [topic.name for topic in open_bag(folder).topics.values() if topic.unreadable]


def test_a_bag_in_several_files_is_one_bag(tmp_path):
    shutil.copy(file_of(POLICY), tmp_path / "bag_0.mcap")
    shutil.copy(file_of(POLICY), tmp_path / "bag_1.mcap")
    assert len(open_bag(tmp_path).of(ACTION)) == 200


def test_arrays_at_once_are_what_message_by_message_gives():
    bag = open_bag(POLICY)
    fast = joint_vectors(bag.of(ACTION), "effort")
    slow = messages(bag.of(ACTION))
    assert fast.names == tuple(slow[0][1].name)
    np.testing.assert_array_equal(fast.values, [m.effort for _, m in slow])
    np.testing.assert_array_equal(fast.stamp_ns, [stamp_of(m) for _, m in slow])
    seen, each = odometries(bag.of(ODOMETRY)), messages(bag.of(ODOMETRY))
    np.testing.assert_array_equal(seen.pose[:, 1], [m.pose.pose.position.y for _, m in each])
    np.testing.assert_array_equal(seen.pose[:, 6], [m.pose.pose.orientation.w for _, m in each])
    np.testing.assert_array_equal(seen.twist[:, 5], [m.twist.twist.angular.z for _, m in each])
    assert seen.frame[0] == "odom"


def test_a_message_with_other_names_goes_the_slow_way_and_is_left_out():
    topic = open_bag(POLICY).of(ACTION)
    topic.data = list(topic.data)
    topic.data[3] = topic.data[3].replace(b"thruster_1", b"thruster_9", 1)
    found = joint_vectors(topic, "effort")
    assert found.left_out == 1
    assert len(found) == len(topic) - 1


@pytest.mark.parametrize("storage", STORAGES)
def test_a_bag_that_others_recorded_loads_in_info_plot_and_rerun(tmp_path, storage):
    bag = write_foreign(tmp_path / "bag", storage)
    found = answer("info", bag)
    odometry = next(topic for topic in found["topics"] if topic["name"] == "/base/odometry")
    assert odometry["count"] == 200
    assert odometry["rate_hz"] == pytest.approx(50.0)
    assert not found["provenance"]["recorded_by_fulmar"]
    files = answer("plot", bag, "--out", tmp_path / "p.html", "--out", tmp_path / "p.png")["files"]
    page = Path(files[0]).read_text()
    assert "<svg" in page
    assert not re.search(r'(src|href|url\()[="\']*https?:', page.replace("xlink:href", "href"))
    assert Path(files[1]).read_bytes().startswith(b"\x89PNG")
    asked = ("--robot", "turtlebot2", "--task", "go_to_position", "--goal", "0,0,0")
    done = answer("rerun", bag, "--controller", "policy", *asked)
    assert not done["compared"]
    assert done["asked"] == done["steps"] > 30
    assert ask("rerun", bag, "--controller", "policy", *asked).exit_code == 1


@pytest.mark.parametrize(
    ("storage", "mode"),
    [
        *itertools.product(STORAGES, (CompressionMode.FILE, CompressionMode.MESSAGE)),
        (StoragePlugin.MCAP, CompressionMode.STORAGE),
    ],
)
def test_a_compressed_bag_is_the_same_as_a_plain_one(tmp_path, storage, mode):
    plain = open_bag(write_foreign(tmp_path / "plain", storage))
    packed = open_bag(write_foreign(tmp_path / "packed", storage, compression=mode))
    assert packed.warnings == ()
    assert packed.storage == plain.storage
    assert packed.topics == plain.topics
    assert open_bag(packed.files[0]).topics == plain.topics


def test_odometry_whose_stamps_stay_zero_is_run_again_by_the_times_of_recording(tmp_path):
    asked = ("--controller", "policy", "--robot", "turtlebot2", "--task", "go_to_position", "--goal", "0,0,0")
    stamped = answer("rerun", write_foreign(tmp_path / "stamped", StoragePlugin.MCAP), *asked)
    done = answer("rerun", write_foreign(tmp_path / "bag", StoragePlugin.MCAP, stamped=False), *asked)
    assert done["asked"] == done["steps"] == stamped["steps"]
    assert any("do not advance" in warning for warning in done["warnings"])


def test_a_foreign_bag_without_a_goal_or_a_robot_says_what_to_give(tmp_path):
    bag = write_foreign(tmp_path / "bag", StoragePlugin.SQLITE3, count=5)
    assert "--robot" in str(ask("rerun", bag, "--controller", "lqr").exception)
    named = ask("rerun", bag, "--controller", "lqr", "--robot", "floating_platform", "--task", "go_to_pose")
    assert "goal" in named.stderr + named.stdout + str(named.exception)
