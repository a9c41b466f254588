"""Messages are read from bytes as rclpy reads them, whatever changes from one to the next."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped, QuaternionStamped, TwistWithCovarianceStamped
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import BatteryState, FluidPressure, Imu, JointState
from std_msgs.msg import Float64MultiArray

from fulmar_ros import bytes_reader
from fulmar_ros.bytes_reader import MOST_LAYOUTS, BytesReader
from fulmar_ros.wire_image import numbers_in

DRAW = np.random.default_rng(3)
KINDS = [Imu, PoseStamped, QuaternionStamped, TwistWithCovarianceStamped, FluidPressure, BatteryState]


def filled(kind, **more):
    message = kind(**more)
    for _, part, name, count in list(numbers_in(message)):
        setattr(part, name, float(DRAW.normal()) if count is None else DRAW.normal(size=count).tolist())
    message.header.frame_id = "odom"
    message.header.stamp.sec, message.header.stamp.nanosec = (int(n) for n in DRAW.integers(0, 10**9, 2))
    return message


def same(found, message) -> bool:
    """Whether an object has the fields of a message, of the types that rclpy gives them."""
    for name in message.get_fields_and_field_types():
        value, read = getattr(message, name), getattr(found, name)
        if hasattr(value, "get_fields_and_field_types"):
            if not same(read, value):
                return False
        elif type(read) is not type(value) or not np.array_equal(read, value):
            return False
    return True


def joints(names, **fields):
    return filled(JointState, name=names, **fields)


@pytest.fixture
def deserialised(monkeypatch):
    count = []
    usual = bytes_reader.deserialized
    monkeypatch.setattr(bytes_reader, "deserialized", lambda *given: count.append(1) or usual(*given))
    return count


@pytest.mark.parametrize("kind", KINDS)
def test_every_message_has_the_fields_that_rclpy_gives_it(kind, deserialised):
    reader = BytesReader(kind)
    for _ in range(5):
        message = filled(kind)
        assert same(reader.read(serialize_message(message)), message)
    assert len(deserialised) == (5 if kind is BatteryState else 1)  # which holds other numbers than doubles


def test_names_lengths_and_frames_may_change_and_few_layouts_are_learned(deserialised):
    reader = BytesReader(JointState)
    counts = joints(["/a"], position=[0.0])
    more = joints(["/a", "/b"], position=[0.0, 0.0])
    moving = joints(["/a"], position=[0.0], velocity=[0.0])  # no layout: a length stands between its numbers
    moved = copy.deepcopy(counts)
    moved.header.frame_id = "elsewhere"
    for message in (counts, more, moving, moved, JointState(), counts, more, moved):
        assert same(reader.read(serialize_message(message)), message)
    assert len(reader._known) == 2 + 1
    assert len(deserialised) == 5
    for number in range(2 * MOST_LAYOUTS):
        message = joints([str(number)], position=[0.0])
        assert same(reader.read(serialize_message(message)), message)
    assert len(reader._known) <= MOST_LAYOUTS


@pytest.mark.parametrize("message", [Clock(), Float64MultiArray(data=[1.0, 2.0])])
def test_messages_without_a_header_are_deserialised(message):
    reader = BytesReader(type(message))
    for _ in range(2):
        assert reader.read(serialize_message(message)) == message


def test_bytes_that_are_none_are_not_passed_on():
    got = []
    receive = BytesReader(Imu).passing(got.append)
    data = serialize_message(filled(Imu))
    for each in (data[:40], b"", data, data[:-60]):
        receive(each)
    assert len(got) == 1
