"""Readings of sensors as messages, and which of them a plant publishes."""

from __future__ import annotations

import struct
from dataclasses import replace

import numpy as np
import pytest
from geometry_msgs.msg import QuaternionStamped
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState

from fulmar_bags.message_reader import reading_of
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.imu import ImuSample
from fulmar_core.robots.sensors.star_tracker import StarTrackerSpec
from fulmar_core.robots.sensors.table import SENSORS
from fulmar_core.robots.sensors.wheels import WheelSpeeds
from fulmar_core.wires.reading import Reading
from fulmar_core.wires.robot_name import PLAIN, Frames
from fulmar_ros.sensor_wires import ReadingWriter, SensorWires
from fulmar_ros.wire_image import canonical_bytes
from tests.states import planar_state

FORCE = np.array([0.1, -0.0, 9.8])
ATTITUDE = np.array([0.0, 0.6, 0.0, 0.8])
PLATFORM = load_robot("floating_platform")
ROBOT = replace(PLATFORM, sensors=replace(PLATFORM.sensors, star_tracker=StarTrackerSpec()))
KIND = SENSORS["star_tracker"]


def test_an_attitude_is_written_and_read_by_its_row():
    data = ReadingWriter(KIND, StarTrackerSpec(), Frames("alpha/")).write(Reading(ATTITUDE), 3_000_000_007)
    message = deserialize_message(data, QuaternionStamped)
    assert message.header.frame_id == "inertial"
    read = reading_of(message, KIND)
    assert read.stamp_ns == 3_000_000_007
    np.testing.assert_array_equal(read.value, ATTITUDE)


def test_frames_of_a_robot_have_its_prefix():
    assert ReadingWriter(SENSORS["imu"], ROBOT.sensors.imu, Frames("alpha/"))._message.header.frame_id == (
        "alpha/imu_link"
    )


class Topic:
    """A publisher that keeps what it publishes."""

    def __init__(self, name, listeners):
        self.name, self.listeners, self.sent = name, listeners, []

    def get_subscription_count(self):
        return self.listeners


class Node:
    def __init__(self):
        self.topics = {}

    def create_publisher(self, _kind, name, _qos):
        return self.topics.setdefault(name, Topic(name, 1))


def publish(topic, message):
    seconds, nanoseconds = struct.unpack_from("<iI", message, 4)
    topic.sent.append(seconds * 1_000_000_000 + nanoseconds)


@pytest.fixture
def node():
    return Node()


def wires_of(node, odometry=True, robot=ROBOT):
    return SensorWires(node, robot, PLAIN, lambda wire: wire, publish, odometry=odometry)


def sample(**star):
    return {"odometry": Reading(planar_state(0.0, 0.0, 0.0)), "star_tracker": Reading(ATTITUDE, **star)}


def test_a_robot_publishes_the_sensors_of_its_file_and_no_others(node):
    wires_of(node, robot=PLATFORM).publish(sample(), 5)
    assert list(node.topics) == ["odom", "imu/data", "supply/pressure"]
    assert len(node.topics["odom"].sent) == 1


@pytest.mark.parametrize(("lockstep", "last"), [(True, "odom"), (False, "imu/data")])
def test_in_lock_step_the_odometry_goes_out_after_what_belongs_to_it(node, lockstep, last):
    sent = []
    wires = SensorWires(
        node,
        PLATFORM,
        PLAIN,
        lambda wire: wire,
        lambda topic, _: sent.append(topic.name),
        odometry=True,
        lockstep=lockstep,
    )
    force = ImuSample(np.zeros(3), np.zeros(3))
    wires.publish(sample() | {"imu": Reading(force)}, 5)
    assert sent[-1] == last
    assert set(sent) == {"odom", "imu/data"}


def test_odometry_of_another_node_is_not_published(node):
    wires = wires_of(node, odometry=False)
    wires.publish(sample(), 5)
    assert wires.odometry is None
    assert list(node.topics) == ["imu/data", "attitude", "supply/pressure"]
    assert node.topics["attitude"].sent == [5]


def test_a_simulated_reading_is_stamped_by_its_age(node):
    wires_of(node).publish(sample(age_s=0.25), 1_000_000_000)
    assert node.topics["attitude"].sent == [750_000_000]


def test_a_resent_sample_repeats_the_odometry_alone(node):
    wires = wires_of(node)
    wires.publish(sample(), 5)
    wires.publish_odometry(sample(), 5)
    assert (len(node.topics["odom"].sent), len(node.topics["attitude"].sent)) == (2, 1)


def test_a_reading_with_a_stamp_of_its_own_is_published_once_until_the_clock_is_set(node):
    wires, second = wires_of(node), 1_000_000_000
    for stamp in (50 * second, 50 * second, 51 * second, 50 * second, 1 * second):
        wires.publish(sample(stamp_ns=stamp), 60 * second)
    assert node.topics["attitude"].sent == [50 * second, 51 * second, second]
    assert len(node.topics["odom"].sent) == 5


def test_of_a_sample_that_comes_again_only_stamped_readings_count(node):
    wires = wires_of(node)
    wires.publish_stamped(sample(stamp_ns=7), 5)
    wires.publish_stamped(sample(), 5)
    assert node.topics["odom"].sent == []
    assert node.topics["attitude"].sent == [7]


def test_a_sensor_without_a_subscriber_is_not_written_and_odometry_always_is(node):
    wires = wires_of(node)
    for topic in node.topics.values():
        topic.listeners = 0
    wires.publish(sample(), 5)
    assert (len(node.topics["odom"].sent), len(node.topics["attitude"].sent)) == (1, 0)


@pytest.mark.parametrize(
    ("name", "robot", "readings"),
    [
        (
            "imu",
            "turtlebot2",
            [
                Reading(ImuSample(np.array([0.1, -0.0, 9.8]), np.array([1e-300, 0.2, each])))
                for each in (0.3, np.nan)
            ],
        ),
        ("star_tracker", "cubesat_wheels", [Reading(ATTITUDE), Reading(-ATTITUDE)]),
        (
            "wheels",
            "cubesat_wheels",
            [Reading(WheelSpeeds(("a", "b"), np.array([1.0, each]))) for each in (2.0, 3.0)],
        ),
        ("supply", "spacecraft_16", [Reading(2e7, covariance=np.eye(1)), Reading(1e7)]),
    ],
)
def test_readings_are_written_as_the_bytes_that_rclpy_makes(name, robot, readings):
    kind, spec = SENSORS[name], load_robot(robot).sensors.specs[name]
    writer = ReadingWriter(kind, spec, Frames("alpha/"))
    for reading in (*readings, readings[0]):
        data = writer.write(reading, 3_000_000_007)
        plain = ReadingWriter(kind, spec, Frames("alpha/"))
        plain._has_layout = False
        assert isinstance(data, bytes)
        assert data == canonical_bytes(plain.write(reading, 3_000_000_007))


def test_a_reading_with_more_parts_than_the_one_before_is_written_whole():
    writer = ReadingWriter(SENSORS["wheels"], None)
    for names in (("a", "b"), ("a", "b", "c"), ("c", "b")):
        speeds = WheelSpeeds(names, np.arange(float(len(names))))
        read = reading_of(
            deserialize_message(writer.write(Reading(speeds), 1), JointState), SENSORS["wheels"]
        )
        assert read.value.names == names
        np.testing.assert_array_equal(read.value.speeds, speeds.speeds)
