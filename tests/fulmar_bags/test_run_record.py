"""Runs are read without ROS; damage costs what is damaged, and is named."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest
from geometry_msgs.msg import PoseArray
from mcap.records import Channel, Message, Schema
from rclpy.serialization import serialize_message

from fulmar_bags import contents
from fulmar_bags.bag_reading import BagReading
from fulmar_bags.mcap_records import read_records
from fulmar_bags.message_reader import goal_of
from fulmar_bags.message_types import type_store
from fulmar_bags.run_record import read_run
from fulmar_bags.wire_reader import WireReader
from fulmar_bags.writer import BagWriter
from fulmar_core.config.errors import BagError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import GOAL_POSES, GOAL_WIRES
from fulmar_core.tasks.goal import goal_at
from fulmar_ros.goal_messages import goal_message


def file_of(bag: Path) -> Path:
    return next(bag.glob("*.mcap"))


def test_every_stream_comes_with_its_times(reached):
    record = read_run(reached)
    assert record.warnings == ()
    for stream in (record.truth, record.odom, record.applied):
        assert len(stream) == 2001
        assert np.allclose(np.diff(stream.stamp_s), 0.02)
        assert np.all(np.diff(stream.log_s) >= 0.0)
    assert len(record.commanded) == 201
    assert np.isin(record.commanded.stamp_s, record.odom.stamp_s).all()
    assert record.applied.names == load_robot("floating_platform").actuators.names


def test_velocities_are_turned_into_the_world(reached):
    motion = read_run(reached).truth
    moved = np.gradient(motion.position, motion.stamp_s, axis=0)
    assert np.allclose(moved[1:-1], motion.velocity_in_world[1:-1], atol=5e-3)


def test_what_was_asked_for_and_who_did_it_come_along(reached):
    record = read_run(reached)
    assert record.info["goal"] == [0.0, 0.0, 0.0]
    assert record.controller["controller"] == "lqr"
    assert [goal.targets.tolist() for goal in record.goals] == [[[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]]]
    assert record.last_health("plant").values["watchdog_trips"] == "0"
    assert record.last_health("controller").values["mode"] == "active"
    assert record.last_health("nobody") is None


def test_the_file_alone_is_as_good_as_its_folder(reached):
    assert len(read_run(file_of(reached)).truth) == 2001


def rewritten_in_parts(bag: Path, folder: Path) -> Path:
    """The same bag in files of a thousand messages."""
    parts = BagWriter(folder, run_info=read_run(bag).info)
    topics: dict[int, str] = {}
    schemas: dict[int, str] = {}
    for record in read_records(file_of(bag), []):
        if isinstance(record, Schema):
            schemas[record.id] = record.name
        elif isinstance(record, Channel) and record.topic not in topics.values():
            topics[record.id] = record.topic
            parts.add_topic(record.topic, schemas[record.schema_id], "stream")
        elif isinstance(record, Message):
            parts.write(topics[record.channel_id], record.data, log_ns=record.log_time)
            if parts.counts.messages % 1000 == 0:
                parts.split()
    parts.close()
    return folder


def test_a_bag_of_several_files_is_one_run(reached, tmp_path):
    parts = rewritten_in_parts(reached, tmp_path / "parts")
    assert len(list(parts.glob("*.mcap"))) > 5
    one, several = read_run(reached), read_run(parts)
    assert several.warnings == ()
    assert np.array_equal(one.truth.position, several.truth.position)
    assert np.array_equal(one.commanded.effort, several.commanded.effort)
    assert one.info == several.info


def test_of_several_files_an_empty_one_costs_only_itself(reached, tmp_path):
    parts = rewritten_in_parts(reached, tmp_path / "parts")
    whole = len(read_run(parts).truth)
    (parts / "parts_2.mcap").write_bytes(b"")
    record = read_run(parts)
    assert 0 < whole - len(record.truth) <= 1000
    assert any("parts_2.mcap" in warning for warning in record.warnings)


@pytest.mark.parametrize("info", [{"robot": "floating_platform"}, {}])
def test_names_of_topics_are_not_compared_anew_for_each_message(info, tmp_path, monkeypatch):
    compared = []
    monkeypatch.setattr(contents, "is_of_wire", lambda topic, wire: compared.append(topic))
    bag = BagWriter(tmp_path / "bag", run_info=info)
    kind, topic = GOAL_WIRES["goal_pose"].type, "/floating_platform/goal_pose"
    bag.add_topic(topic, kind, "latched")
    for log_ns in range(1, 101):
        message = goal_message(goal_at((2.5, -1.5, 0.0)), "goal_pose", log_ns)
        bag.write(topic, serialize_message(message), log_ns=log_ns)
    bag.close()
    opened = contents.open_bag(tmp_path / "bag", BagReading(topics={"goal_pose": topic}))
    assert len(WireReader(opened).received(GOAL_WIRES["goal_pose"], goal_of)) == 100
    assert len(compared) < 10


def test_a_goal_point_is_a_goal_too(tmp_path):
    from tests.synthetic_run import Plan, write_run

    bag = write_run(tmp_path / "bag", Plan(task="go_to_position", duration_s=1.0, goal=(1.0, 2.0, 0.0)))
    (goal,) = read_run(bag).goals
    assert goal.targets.tolist() == [[1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0]]


def test_a_goal_on_a_topic_that_the_task_does_not_receive_is_left_out_and_named(tmp_path):
    bag = BagWriter(tmp_path / "bag", run_info={"robot": "floating_platform", "task": "track_velocities"})
    for wire, targets in (("goal_velocity", (0.1, 0.0, 0.0)), ("goal_pose", (2.5, -1.5, 0.0))):
        message = goal_message(goal_at(targets), wire, 1)
        kind = GOAL_WIRES[wire].type
        bag.add_topic(f"/floating_platform/{wire}", kind, "latched")
        bag.write(f"/floating_platform/{wire}", serialize_message(message), log_ns=1)
    bag.close()
    record = read_run(tmp_path / "bag")
    assert [goal.targets.tolist() for goal in record.goals] == [[[0.1, 0.0, 0.0, 0.0, 0.0, 0.0]]]
    assert record.warnings == (
        "1 messages of /floating_platform/goal_pose are left out: no goals of the task 'track_velocities'.",
    )


def test_waypoints_as_an_array_of_poses_are_goals_of_the_same_task_in_their_order(tmp_path):
    bag = BagWriter(tmp_path / "bag", run_info={"robot": "floating_platform", "task": "go_through_positions"})
    for log_ns, name in ((2, GOAL_POSES.name), (1, "goal_path")):
        path = goal_message(goal_at((float(log_ns), 0.0, 0.0)), "goal_path", 1)
        array = PoseArray(header=path.header, poses=[stamped.pose for stamped in path.poses])
        kind = GOAL_POSES.type if name == GOAL_POSES.name else GOAL_WIRES[name].type
        bag.add_topic(f"/floating_platform/{name}", kind, "latched")
        message = array if name == GOAL_POSES.name else path
        bag.write(f"/floating_platform/{name}", serialize_message(message), log_ns=log_ns)
    bag.close()
    record = read_run(tmp_path / "bag")
    assert [goal.targets[0, 0] for goal in record.goals] == [1.0, 2.0]
    assert not record.warnings


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9, 0.999])
def test_a_truncated_bag_is_read_up_to_the_cut(reached, copy_of, share):
    bag = copy_of(reached)
    whole = file_of(bag).read_bytes()
    file_of(bag).write_bytes(whole[: int(share * len(whole))])
    record = read_run(bag)
    assert 0 < len(record.truth) <= 2001
    assert len(record.truth) >= 0.6 * share * 2001
    assert record.warnings or len(record.truth) == 2001


def test_flipped_bits_never_end_in_anything_but_a_record_or_a_clear_error(reached, copy_of):
    bag = copy_of(reached)
    whole = file_of(bag).read_bytes()
    rng = random.Random(1)
    outcomes = set()
    for _ in range(8):
        damaged = bytearray(whole)
        for _ in range(rng.randint(1, 8)):
            damaged[rng.randrange(len(damaged))] ^= 1 << rng.randrange(8)
        file_of(bag).write_bytes(damaged)
        try:
            record = read_run(bag)
            outcomes.add("damaged" if record.warnings else "whole")
            assert len(record.truth) == 2001 or record.warnings
        except BagError as error:
            outcomes.add("refused")
            assert "\n" not in str(error)
    assert "damaged" in outcomes


def test_run_information_is_found_beside_a_file_that_lost_it(reached, copy_of):
    bag = copy_of(reached)
    whole = file_of(bag).read_bytes()
    file_of(bag).write_bytes(whole.replace(b'{"backend"', b'{!backend"'))
    assert read_run(bag).info["robot"] == "floating_platform"


def test_an_empty_file_is_named(reached, copy_of):
    bag = copy_of(reached)
    file_of(bag).write_bytes(b"")
    with pytest.raises(BagError, match="the file is empty"):
        read_run(bag)


def test_a_bag_without_messages_is_a_record_with_a_warning(tmp_path):
    BagWriter(tmp_path / "bag", run_info={"robot": "floating_platform"}).close()
    record = read_run(tmp_path / "bag")
    assert len(record.motion) == 0
    assert "holds no message" in record.warnings[0]


def test_a_foreign_bag_is_refused_with_what_it_holds(tmp_path):
    from rosbags.rosbag2 import Writer
    from rosbags.rosbag2.enums import StoragePlugin

    with Writer(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        store = type_store()
        connection = writer.add_connection("/chatter", "std_msgs/msg/String", typestore=store)
        message = store.types["std_msgs/msg/String"]("hello")
        writer.write(connection, 1, store.serialize_cdr(message, "std_msgs/msg/String"))
    with pytest.raises(BagError, match="/chatter"):
        read_run(tmp_path / "bag")


def test_what_is_no_bag_at_all_is_refused(tmp_path):
    with pytest.raises(BagError, match="no such bag"):
        read_run(tmp_path / "nothing")
    with pytest.raises(BagError, match=r"no \.mcap and no \.db3 file"):
        read_run(tmp_path)
    (tmp_path / "notes.txt").write_text("not a bag")
    with pytest.raises(BagError, match="this is no bag"):
        read_run(tmp_path / "notes.txt")


def test_a_topic_of_another_type_is_left_out_and_named(tmp_path):
    bag = BagWriter(tmp_path / "bag", run_info={"robot": "floating_platform"})
    bag.add_topic("/floating_platform/odom", "std_msgs/msg/String", "stream")
    store = type_store()
    text = store.serialize_cdr(store.types["std_msgs/msg/String"]("x"), "std_msgs/msg/String")
    bag.write("/floating_platform/odom", bytes(text), log_ns=1)
    bag.close()
    record = read_run(tmp_path / "bag")
    assert len(record.odom) == 0
    assert record.warnings == ("1 messages of /floating_platform/odom have another type.",)
