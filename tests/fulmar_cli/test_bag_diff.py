"""`fulmar bag diff`: bags are the same only if everything in them was compared and is the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import Writer
from rosbags.rosbag2.enums import StoragePlugin

from fulmar_bags.comparison import differing
from fulmar_bags.contents import open_bag
from fulmar_bags.decode import messages, stamp_of
from fulmar_bags.message_types import type_store
from fulmar_bags.writer import BagWriter
from fulmar_core.robots.topics import ODOMETRY
from tests.fulmar_cli.bag_commands import LQR, POLICY, answer, ask

SCAN, PATH = "sensor_msgs/msg/LaserScan", "nav_msgs/msg/Path"


def bag_of(folder: Path, kind: str, *messages: bytes) -> Path:
    bag = BagWriter(folder, run_info={"robot": "floating_platform"})
    bag.add_topic("/floating_platform/it", kind, "stream")
    for number, data in enumerate(messages):
        bag.write("/floating_platform/it", data, log_ns=number)
    bag.close()
    return folder


def strange(folder: Path, *messages: bytes) -> Path:
    """A bag with messages of a type of somebody's own."""
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topic = writer.add_connection(
            "/it", "theirs/msg/Own", msgdef="int8[4] it", rihs01="RIHS01_" + 64 * "0"
        )
        for number, data in enumerate(messages):
            writer.write(topic, number, data)
    return folder


def difference(one: Path, other: Path, tolerance: float = 0.0) -> dict:
    return differing(open_bag(one), open_bag(other), tolerance=tolerance)


def header() -> object:
    new = type_store().types
    return new["std_msgs/msg/Header"](new["builtin_interfaces/msg/Time"](1, 0), "odom")


def scan(ranges: np.ndarray) -> bytes:
    numbers = (0.0, 1.0, 0.1, 0.0, 0.1, 0.0, 9.0)
    message = type_store().types[SCAN](header(), *numbers, ranges.astype(np.float32), np.zeros(0, np.float32))
    return bytes(type_store().serialize_cdr(message, SCAN))


def path(last: float) -> bytes:
    new = type_store().types
    poses = [
        new["geometry_msgs/msg/PoseStamped"](
            header(),
            new["geometry_msgs/msg/Pose"](
                new["geometry_msgs/msg/Point"](last if i == 99 else float(i), 0.0, 0.0),
                new["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0),
            ),
        )
        for i in range(100)
    ]
    return bytes(type_store().serialize_cdr(new[PATH](header(), poses), PATH))


def test_messages_of_a_type_that_nobody_knows_are_compared_byte_by_byte(tmp_path):
    one = strange(tmp_path / "one", b"\0\1\0\0abcd", b"\0\1\0\0same")
    other = strange(tmp_path / "other", b"\0\1\0\0abcX", b"\0\1\0\0same")
    found = difference(one, other)
    assert not found["same"]
    assert found["topics"][0]["bytes"] == 1
    assert difference(one, one)["same"]


def test_messages_that_are_torn_are_compared_byte_by_byte(tmp_path):
    whole = scan(np.zeros(3))
    one = bag_of(tmp_path / "one", SCAN, whole, whole[:20])
    assert not difference(one, bag_of(tmp_path / "other", SCAN, whole, whole[:24]))["same"]
    assert not difference(one, bag_of(tmp_path / "shorter", SCAN, whole))["same"]


def test_arrays_too_long_for_columns_are_compared_within_the_tolerance(tmp_path):
    ranges = np.linspace(1.0, 2.0, 360)
    one, other = bag_of(tmp_path / "one", SCAN, scan(ranges)), ranges.copy()
    other[300] += 0.25
    other = bag_of(tmp_path / "other", SCAN, scan(other))
    found = difference(one, other)
    assert not found["same"]
    assert found["topics"][0]["texts"] == [{"field": "ranges", "differing": 1}]
    assert difference(one, other, tolerance=0.3)["same"]
    assert difference(one, one)["same"]


@pytest.mark.parametrize(("last", "same"), [(99.0, True), (98.0, False)])
def test_the_last_of_many_waypoints_is_compared(tmp_path, last, same):
    one, other = bag_of(tmp_path / "one", PATH, path(99.0)), bag_of(tmp_path / "other", PATH, path(last))
    assert difference(one, other)["same"] == same


def test_bags_without_a_message_are_not_called_the_same(tmp_path):
    one, other = bag_of(tmp_path / "one", SCAN), bag_of(tmp_path / "other", SCAN)
    found = difference(one, other)
    assert (found["compared"], found["same"]) == (0, False)


def test_a_bag_is_the_same_as_itself_and_differs_from_another():
    assert answer("diff", POLICY, POLICY)["same"]
    assert ask("diff", POLICY, POLICY).exit_code == 0
    found = answer("diff", POLICY, LQR)
    assert not found["same"]
    assert found["provenance"]["controller"] == ["policy", "lqr"]
    assert ask("diff", POLICY, LQR).exit_code == 1


def test_a_diff_names_the_field_and_the_time_of_the_first_difference(copy, tmp_path):
    bag = open_bag(copy)
    topic = bag.of(ODOMETRY)
    (log, message) = messages(topic)[7]
    message.pose.pose.position.x += 0.25
    out = BagWriter(tmp_path / "changed", run_info=bag.info)
    for each in bag.topics.values():
        out.add_topic(each.name, each.type, "stream")
    for each in bag.topics.values():
        for index, data in enumerate(each.data):
            changed = type_store().serialize_cdr(message, each.type) if each is topic and index == 7 else data
            out.write(each.name, bytes(changed), log_ns=each.log_ns[index])
    out.close()
    found = answer("diff", copy, tmp_path / "changed")
    (field,) = [f for t in found["topics"] if t["topic"] == "odom" for f in t["fields"]]
    assert field["name"] == "pose.pose.position.x"
    assert field["first_stamp_s"] == pytest.approx(stamp_of(message) / 1e9)
    assert field["found"] - field["recorded"] == pytest.approx(0.25)
    assert log == topic.log_ns[7]
    assert answer("diff", copy, tmp_path / "changed", "--tolerance", "0.3")["same"]


def test_a_diff_of_two_runs_ends_with_the_command_that_compares_runs():
    assert ask("diff", POLICY, LQR).output.endswith(
        f"to compare the two runs: fulmar report {POLICY} {LQR}\n"
    )
    assert "fulmar report" not in ask("diff", POLICY, LQR, "--json").output
