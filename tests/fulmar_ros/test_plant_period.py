"""What a plant counts, holds back and repeats in a period of lock step; equal messages as equal bytes."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
import rclpy
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from rclpy.signals import SignalHandlerOptions
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState

from fulmar_bags.message_types import canonical
from fulmar_ros import plant_period
from fulmar_ros.convert import stamp_of
from fulmar_ros.plant_period import PlantPeriod
from fulmar_ros.recorder_node import REMEMBERED, once
from fulmar_ros.wire_image import canonical_bytes
from tests.conftest import RosDomain

MS = 1_000_000


class Plant:
    """A period, its publishers, and what goes out by the name of the topic."""

    def __init__(self, node: Node, monkeypatch: pytest.MonkeyPatch) -> None:
        import threading

        self.sent: list[tuple[str, bytes]] = []
        monkeypatch.setattr(
            plant_period,
            "publish_patiently",
            lambda publisher, message: self.sent.append((publisher.topic_name, message)),
        )
        self.lock = threading.Condition()
        self.period = PlantPeriod(node, ["estimator", "camera"], self.lock)
        self.imu = node.create_publisher(Imu, "imu/data", 10)
        self.odom = node.create_publisher(Odometry, "odom", 10)
        self.truth = node.create_publisher(Odometry, "ground_truth/odom", 10)
        self.clock = node.create_publisher(Clock, "/clock", 10)
        self.period.distinguish(odometry=self.odom, truth=self.truth, clock=self.clock)

    def publish(self, time_ns: int, *, within: bool = False, imu_ns: int | None = None) -> None:
        self.period.within = within
        for publisher, message in ((self.odom, Odometry()), (self.imu, Imu()), (self.truth, Odometry())):
            stamp = imu_ns if isinstance(message, Imu) and imu_ns is not None else time_ns
            message.header.stamp = stamp_of(stamp)
            self.period.publish(publisher, message)
        self.period.publish(self.clock, Clock())

    @property
    def topics(self) -> list[str]:
        return [topic.removeprefix("/r/") for topic, _ in self.sent]


@pytest.fixture
def plant(ros_domain: RosDomain, monkeypatch: pytest.MonkeyPatch) -> Iterator[Plant]:
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("plant", namespace="r")
    yield Plant(node, monkeypatch)
    node.destroy_node()
    rclpy.try_shutdown()


def end_of(data: bytes) -> dict[str, float]:
    message = deserialize_message(data, JointState)
    return dict(zip(message.name, message.position, strict=True))


def test_readings_of_every_tick_count_and_odometry_and_truth_come_once(plant: Plant) -> None:
    plant.publish(20 * MS, within=True)
    plant.publish(40 * MS)
    plant.period.close(40 * MS)
    assert plant.topics == ["imu/data", "odom", "imu/data", "ground_truth/odom", "/clock", "lockstep/period"]
    assert end_of(plant.sent[-1][1]) == {"/r/imu/data": 2.0, "/r/odom": 1.0}


def test_a_repetition_has_the_readings_and_the_end_once_more_until_the_next_period(plant: Plant) -> None:
    plant.publish(20 * MS)
    plant.period.close(20 * MS)
    first = list(plant.sent)
    plant.sent.clear()
    plant.period.repeat()
    assert plant.sent == [one for one in first if one[0] not in ("/clock", "/r/ground_truth/odom")]
    plant.period.begin()
    plant.sent.clear()
    plant.period.repeat()
    assert plant.sent == []


def test_a_reading_that_repeats_its_stamp_is_not_counted_again(plant: Plant) -> None:
    plant.publish(20 * MS)
    plant.period.close(20 * MS)
    plant.period.begin()
    plant.publish(40 * MS, imu_ns=20 * MS)
    plant.period.close(40 * MS)
    assert end_of(plant.sent[-1][1]) == {"/r/odom": 1.0}


def test_a_period_is_answered_by_every_node_of_the_chain(plant: Plant) -> None:
    def answer(name: str, time_ns: int, count: float) -> None:
        message = JointState(name=["/r/odom"], position=[count])
        message.header.stamp, message.header.frame_id = stamp_of(time_ns), name
        plant.period._on_answer(message)

    assert plant.period.silent(20 * MS) == ["estimator", "camera"]
    answer("camera", 20 * MS, 0.0)
    answer("estimator", 10 * MS, 1.0)
    assert plant.period.silent(20 * MS) == ["estimator"]
    answer("estimator", 20 * MS, 0.0)
    assert (plant.period.silent(20 * MS), plant.period.has_odometry()) == ([], False)
    answer("estimator", 40 * MS, 1.0)
    assert plant.period.has_odometry()


def test_bytes_between_fields_and_room_at_the_end_do_not_matter() -> None:
    message = JointState(name=["a"], position=[1.0])
    data = canonical_bytes(message)
    kind = "sensor_msgs/msg/JointState"
    padded = bytearray(data)
    at = data.index(b"a\0")  # two bytes of text, two that fill up to a multiple of four
    assert data[at : at + 4] == b"a\0\0\0"
    padded[at + 2 : at + 4] = b"xy"
    assert canonical(bytes(padded) + b"\0\1\2\3", kind) == data
    assert deserialize_message(data, JointState) == message
    with pytest.raises(ValueError, match="are no sensor_msgs/msg/JointState"):
        canonical(data + bytes(64), kind)


def test_a_recorder_leaves_out_what_equals_one_of_the_newest_messages() -> None:
    kept: list[bytes] = []
    keep = once(lambda data, _info: kept.append(data), REMEMBERED)
    for data in (b"a", b"b", b"a", b"c"):
        keep(data, {})
    assert kept == [b"a", b"b", b"c"]
    for number in range(REMEMBERED):
        keep(str(number).encode(), {})
    keep(b"a", {})
    assert kept[-1] == b"a"
    kept.clear()
    keep = once(lambda data, _info: kept.append(data), 1)
    for data in (b"on", b"on", b"off", b"on"):
        keep(data, {})
    assert kept == [b"on", b"off", b"on"]
