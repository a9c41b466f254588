"""Messages as bytes: the very bytes that rclpy makes, read as rclpy reads them."""

from __future__ import annotations

import numpy as np
import pytest
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState

from fulmar_bags.message_reader import measurement_of
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.state import RigidBodyState
from fulmar_core.wires.robot_name import frames_of
from fulmar_ros.convert import (
    OdometryReader,
    OdometryWriter,
    TwistReader,
    TwistWriter,
    VectorReader,
    VectorWriter,
)
from fulmar_ros.wire_image import LATEST_NS, WireImage

ROBOT = load_robot("floating_platform")
NAMES = ROBOT.actuators.names
STAMPS = (0, 1, 1_234_567_890_123_456_789, -1, -LATEST_NS - 5, LATEST_NS + 5)
SEVERAL = (0.25, -1e300, np.nan, np.inf, 5e-324, -0.0, 1.0 / 3.0, 2.0)


def state(seed: int) -> RigidBodyState:
    draw = np.random.default_rng(seed).normal
    return RigidBodyState(draw(size=3), draw(size=4), draw(size=3), draw(size=3))


def same(found, expected) -> bool:
    """To the last bit."""
    parts = [
        np.asarray(getattr(each.state, name))
        for name in RigidBodyState.__slots__
        for each in (found, expected)
    ]
    alike = all(a.tobytes() == b.tobytes() for a, b in zip(parts[::2], parts[1::2], strict=True))
    frames = (found.frame, found.child_frame) == (expected.frame, expected.child_frame)
    return alike and frames and found.stamp_ns == expected.stamp_ns


@pytest.mark.parametrize("stamp", STAMPS)
@pytest.mark.parametrize(
    ("writer", "values"),
    [
        (OdometryWriter(ROBOT.sensors.odometry), state(1)),
        (OdometryWriter(None, frame="map"), state(2)),
        (VectorWriter(NAMES), np.array(SEVERAL)),
        (VectorWriter(("one",), "position"), np.array([7.0])),
        (VectorWriter(tuple(f"term_{i}" for i in range(300)), "position"), np.arange(300.0)),
        (TwistWriter(), np.array([0.3, -0.7])),
    ],
    ids=["odometry", "truth", "command", "one value", "many values", "twist"],
)
def test_written_bytes_are_the_message_to_the_last_bit(writer, values, stamp):
    for _ in range(2):  # the numbers before leave no trace
        message = writer.write(values, stamp)
        found = writer.raw(values, stamp)
        assert repr(deserialize_message(found, type(message))) == repr(message)
        assert (
            0 <= len(serialize_message(message)) - len(found) <= 8
        )  # room that the serialiser leaves at the end


@pytest.mark.parametrize("filling", [b"\0", b"\xff"])
def test_odometry_is_read_from_its_bytes_as_rclpy_reads_it(filling):
    """Whatever its sender leaves in bytes that mean nothing: behind `odom` and the encoding."""
    data = bytearray(OdometryWriter(ROBOT.sensors.odometry).raw(state(3), 5_000_000_007))
    data[21:24] = 3 * filling
    data = bytes(data)
    assert OdometryReader()._image.read(data) is not None
    assert same(OdometryReader().read(data), measurement_of(deserialize_message(data, Odometry)))


@pytest.mark.parametrize(
    "frames", [("map", "base_link"), ("odom", "base_lynk"), ("", ""), ("o" * 300, "base_link")]
)
def test_odometry_in_other_frames_keeps_them(frames):
    data = OdometryWriter(None, frame=frames[0], child_frame=frames[1]).raw(state(4), 9)
    assert same(OdometryReader().read(data), measurement_of(deserialize_message(data, Odometry)))


def test_a_named_robot_reads_odometry_with_its_prefix_from_the_bytes_and_without_it_too():
    frames = frames_of("alpha", "floating_platform")
    reader = OdometryReader(frames)
    own = OdometryWriter(None, frame=frames.odom, child_frame=frames.base).raw(state(4), 9)
    plain = OdometryWriter(None).raw(state(4), 9)
    assert reader._image.read(own) is not None
    assert same(reader.read(own), OdometryReader().read(plain))
    assert same(reader.read(plain), OdometryReader().read(plain))
    assert OdometryReader().read(own).frame == "alpha/odom"


@pytest.mark.parametrize("names", [NAMES, NAMES[::-1], NAMES[:3], ("x",) * 8])
def test_a_vector_keeps_its_names_and_values(names):
    found = VectorReader(NAMES).read(VectorWriter(names).raw(np.array(SEVERAL[: len(names)]), 17))
    assert tuple(found.names) == tuple(names) and found.stamp_ns == 17
    np.testing.assert_array_equal(found.values, SEVERAL[: len(names)])


def test_a_vector_in_another_field_is_no_effort():
    found = VectorReader(NAMES).read(VectorWriter(NAMES, "position").raw(np.array(SEVERAL), 17))
    assert tuple(found.names) == NAMES and len(found.values) == 0


@pytest.mark.parametrize("frame", ["base_link", "", "elsewhere"])
def test_a_twist_is_read_in_whatever_frame(frame):
    message = TwistStamped()
    message.header.frame_id, message.header.stamp.sec = frame, 3
    message.twist.linear.x, message.twist.angular.z = 0.25, -0.5
    found = TwistReader(("left", "right")).read(serialize_message(message))
    assert (found.values, found.stamp_ns) == ((0.25, -0.5), 3_000_000_000)


@pytest.mark.parametrize("read", [OdometryReader().read, VectorReader(NAMES).read, TwistReader(NAMES).read])
def test_bytes_that_are_no_message_are_none(read):
    whole = OdometryWriter(None).raw(state(5), 1)
    for data in (b"", b"\x00", whole[:40], b"\xff" * len(whole)):
        assert read(data) is None


def test_a_vector_is_read_from_its_bytes_whatever_fills_them_up():
    data = bytearray(VectorWriter(NAMES).raw(np.array(SEVERAL), 17))
    data[17:20] = b"\xff\xff\xff"  # behind the empty frame
    assert VectorReader(NAMES)._image.read(bytes(data) + b"\xff\xff\xff\xff") is not None


@pytest.mark.parametrize("layout", [{"texts": ("", "a")}, {"texts": ("",), "counts": 3}])
def test_a_layout_that_leaves_something_out_is_refused(layout):
    with pytest.raises(ValueError, match="JointState"):
        WireImage(JointState(name=["a"], effort=[2.5]), [2.5], **layout)


def test_numbers_that_are_not_side_by_side_are_refused():
    message = JointState(position=[1.5], effort=[2.5])
    with pytest.raises(ValueError, match="JointState"):
        WireImage(message, [1.5, 2.5], texts=[""])
