"""`fulmar bag info`: counts, rates, gaps and losses, where a bag comes from, and why it was written."""

from __future__ import annotations

import json
import re
import struct

import pytest

from fulmar_bags.contents import open_bag
from fulmar_bags.decode import stamps_ns
from fulmar_bags.figures import describe
from fulmar_bags.ring import FAULTS
from fulmar_bags.writer import BagWriter
from fulmar_core.robots.topics import ODOMETRY
from tests.fulmar_cli.bag_commands import POLICY, answer, ask


def test_info_states_what_the_recorder_dropped_and_which_packages_it_ran_with(tmp_path):
    bag = BagWriter(
        tmp_path / "bag",
        run_info={"robot": "floating_platform"},
        attachments={
            "provenance.json": b'{"python": "3.12.1", "platform": "Linux"}',
            "uncommitted.patch": b"--- a",
        },
    )
    bag.add_topic("/floating_platform/odom", "nav_msgs/msg/Odometry", "stream")
    bag.write("/floating_platform/odom", bytes(100), log_ns=1)
    bag.note("fulmar_recording", json.dumps({"complete": False, "dropped": {"/floating_platform/odom": 7}}))
    bag.close()
    found = describe(open_bag(tmp_path / "bag"))
    assert found["topics"][0]["dropped"] == 7
    assert found["provenance"]["made_by"]["python"] == "3.12.1"
    assert found["provenance"]["uncommitted_changes"] is True
    assert found["provenance"]["recorded_to_its_end"] is False
    assert "was not shut down in order" in ask("info", tmp_path / "bag").stdout


def test_info_states_counts_rates_and_where_a_bag_comes_from():
    found = answer("info", POLICY)
    topics = {topic["name"]: topic for topic in found["topics"]}
    action = topics["/floating_platform/controller/action"]
    assert action["count"] == 100
    assert action["rate_hz"] == pytest.approx(5.0)
    assert action["gaps"] == 0
    assert action["dropped"] == 0
    assert found["provenance"]["robot"] == "floating_platform"
    assert found["provenance"]["controller"] == "policy"
    assert len(found["provenance"]["controller_sha256"]) == 64
    assert found["damage"] == []
    assert ask("info", POLICY).exit_code == 0


def test_info_names_configuration_that_has_changed_since(tmp_path):
    bag = BagWriter(
        tmp_path / "bag",
        run_info={"robot": "floating_platform", "task": "go_to_pose"},
        attachments={"robot.yaml": b"name: another\n"},
    )
    bag.close()
    found = describe(open_bag(tmp_path / "bag"))
    assert found["provenance"]["config_changed_since"] == ["robots/floating_platform.yaml"]


def test_info_counts_gaps_late_and_dropped_messages(tmp_path):
    bag = BagWriter(tmp_path / "bag", run_info={"robot": "floating_platform"})
    bag.add_topic("/floating_platform/odom", ODOMETRY.type, "stream")
    source = open_bag(POLICY).of(ODOMETRY)
    stamps = stamps_ns(source)
    for index, data in enumerate(source.data):
        if 10 <= index < 14:
            continue  # a gap of a second, which is five periods
        late = 500_000_000 if index == 50 else 0
        bag.write(
            "/floating_platform/odom", data, log_ns=1_700_000_000_000_000_000 + int(stamps[index]) + late
        )
    bag.close()
    (topic,) = describe(open_bag(tmp_path / "bag"))["topics"]
    assert topic["gaps"] == 1
    assert topic["longest_gap_s"] == pytest.approx(1.0)
    assert topic["late"] >= 1
    assert topic["delay_ms"]["max"] >= 400.0


def test_a_bag_without_messages_is_reported(tmp_path):
    BagWriter(tmp_path / "bag", run_info={"robot": "floating_platform"}).close()
    assert answer("info", tmp_path / "bag")["messages"] == 0


@pytest.mark.parametrize("closed", [True, False], ids=["closed", "killed"])
def test_info_states_when_and_why_a_ring_was_written(tmp_path, closed):
    bag = BagWriter(tmp_path / "bag", run_info={"robot": "floating_platform"})
    fault = {"time_ns": 1_700_000_000_000_000_000, "reason": "plant: the watchdog tripped"}
    bag.note(FAULTS, json.dumps([fault]))
    if closed:
        bag.close()
        (tmp_path / "bag" / "metadata.yaml").unlink()
    else:
        bag.flush()
    assert answer("info", tmp_path / "bag")["faults"] == [fault]
    assert re.search(
        r"recorded around a fault at 2023-11-1\d .*: plant: the watchdog tripped",
        ask("info", tmp_path / "bag").stdout,
    )


def test_a_stamp_of_0_is_counted_and_makes_no_gap(tmp_path):
    bag = BagWriter(tmp_path / "bag", run_info={"robot": "floating_platform"})
    bag.add_topic("/floating_platform/odom", ODOMETRY.type, "stream")
    source = open_bag(POLICY).of(ODOMETRY)
    stamps = stamps_ns(source) + 1_700_000_000_000_000_000
    for index, data in enumerate(source.data[:50]):
        seconds, rest = divmod(int(stamps[index]), 1_000_000_000)
        stamp = bytes(8) if index == 0 else struct.pack("<iI", seconds, rest)
        bag.write("/floating_platform/odom", data[:4] + stamp + data[12:], log_ns=int(stamps[index]))
    bag.close()
    (topic,) = describe(open_bag(tmp_path / "bag"))["topics"]
    assert topic["unstamped"] == 1
    assert topic["gaps"] == 0
    assert topic["longest_gap_s"] == pytest.approx(0.2)
    assert topic["out_of_order"] == 0
    assert topic["delay_ms"]["max"] == 0.0
    assert "1 of 50 messages have a stamp of 0 (not set)" in ask("info", tmp_path / "bag").stdout
