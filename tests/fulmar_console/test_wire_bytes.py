"""Odometry and states of actuators are read from bytes as rclpy would read them, and nonsense is refused."""

from __future__ import annotations

import numpy as np
import pytest
from nav_msgs.msg import Odometry
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

from fulmar_console.live.wire_bytes import JointReader, UnreadableError, read_odometry


def odometry(frame: str, child: str) -> Odometry:
    message = Odometry(child_frame_id=child)
    message.header.frame_id = frame
    message.header.stamp.sec, message.header.stamp.nanosec = 12, 345
    p, q = message.pose.pose.position, message.pose.pose.orientation
    p.x, p.y, p.z, q.x, q.y, q.z, q.w = 1.0, -2.0, 3.0, 0.1, 0.2, 0.3, 0.9
    return message


@pytest.mark.parametrize("frame", ["odom", "alpha/odom", "a", ""])
@pytest.mark.parametrize("child", ["base_link", "bas", ""])
def test_pose_and_stamp_of_odometry_are_read_whatever_its_frames_are_called(frame: str, child: str) -> None:
    placed = read_odometry(serialize_message(odometry(frame, child)))
    assert placed.stamp_ns == 12_000_000_345
    assert placed.pose == (1.0, -2.0, 3.0, 0.1, 0.2, 0.3, 0.9)


def joints(names: list[str], **values: list[float]) -> bytes:
    message = JointState(name=names, **values)
    message.header.frame_id = "base_link"
    return serialize_message(message)


@pytest.mark.parametrize("names", [["a"], ["nozzle_1", "b"], ["x", "yy", "zzz", "wwww", "v"]])
def test_efforts_are_read_by_name_from_each_of_many_messages(names: list[str]) -> None:
    reader = JointReader()
    for start in (0.0, 1.0, 2.0):
        values = [start + i for i in range(len(names))]
        assert reader.read(joints(names, effort=values)) == tuple(values)
        assert reader.names == tuple(names)


def test_positions_stand_in_where_there_are_no_efforts_and_other_columns_are_passed_over() -> None:
    reader = JointReader()
    assert reader.read(joints(["a", "b"], position=[1.0, 2.0])) == (1.0, 2.0)
    both = joints(["a", "b"], position=[1.0, 2.0], velocity=[3.0, 4.0], effort=[5.0, 6.0])
    assert reader.read(both) == (5.0, 6.0)


def test_other_names_are_noticed() -> None:
    reader = JointReader()
    reader.read(joints(["a", "b"], effort=[1.0, 2.0]))
    assert reader.read(joints(["a", "c", "d"], effort=[1.0, 2.0, 3.0])) == (1.0, 2.0, 3.0)
    assert reader.names == ("a", "c", "d")


def test_a_message_without_a_value_for_each_name_is_refused() -> None:
    with pytest.raises(UnreadableError, match="each name"):
        JointReader().read(joints(["a", "b"], effort=[1.0]))


def test_damaged_bytes_are_refused_and_never_read_past_their_end() -> None:
    good = [serialize_message(odometry("odom", "base_link")), joints(["a", "b"], effort=[1.0, 2.0])]
    generator = np.random.default_rng(0)
    readers = (read_odometry, JointReader().read)
    for data, read in zip(good, readers, strict=True):
        for length in range(len(data) - (8 if read is not read_odometry else 630)):
            with pytest.raises(UnreadableError):
                read(data[:length])
        for _ in range(300):
            damaged = bytearray(data)
            damaged[generator.integers(len(data))] = generator.integers(256)
            try:
                read(bytes(damaged))
            except UnreadableError:
                continue
