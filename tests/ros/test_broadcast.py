"""Observation and action of a controller as tools of ros2_control receive them."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from control_msgs.msg import Float64Values, Keys
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState

from fulmar_core.robots.topics import ACTION, OBSERVATION
from fulmar_ros.broadcast_node import BroadcastNode
from fulmar_ros.operator_subscription import subscribe_every
from fulmar_ros.runtime import spinning
from tests.fulmar_bringup.test_interface_definitions import Definitions
from tests.ros.neighbour import NAMESPACE, Neighbour, Stream, until

pytestmark = pytest.mark.real_time


@pytest.fixture
def broadcast(neighbour: Neighbour) -> Iterator[BroadcastNode]:
    node = BroadcastNode(lambda _code: None, cli_args=["--ros-args", "-r", f"__ns:={NAMESPACE}"])
    with spinning(node, lambda error: pytest.fail(repr(error))):
        yield node


def test_names_come_once_and_values_with_each_control_step(
    neighbour: Neighbour, broadcast: BroadcastNode, stream: Stream
) -> None:
    values: list[Float64Values] = []
    vectors: dict[str, list[JointState]] = {"observation": [], "action": []}
    neighbour.node.create_subscription(Float64Values, "broadcast/values", values.append, 100)
    for wire, name in ((OBSERVATION, "observation"), (ACTION, "action")):
        subscribe_every(neighbour.node, JointState, wire, vectors[name].append)
    until(lambda: len(values) >= 20)
    names: list[Keys] = []
    late = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    neighbour.node.create_subscription(Keys, "broadcast/names", names.append, late)
    until(lambda: bool(names))
    until(lambda: neighbour.said["broadcast"][0] == "broadcasting")
    keys = list(names[-1].keys)
    assert len(names) == 1
    assert keys[0].startswith("observation/")
    assert [key for key in keys if key.startswith("action/")] == [
        f"action/{name}" for name in neighbour.robot.actuators.names
    ]
    by_stamp = {
        name: {(m.header.stamp.sec, m.header.stamp.nanosec): m for m in list(messages)}
        for name, messages in vectors.items()
    }
    compared = 0
    for message in values[:]:
        stamp = message.header.stamp.sec, message.header.stamp.nanosec
        if all(stamp in known for known in by_stamp.values()):
            seen, done = by_stamp["observation"][stamp], by_stamp["action"][stamp]
            assert [f"observation/{name}" for name in seen.name] == keys[: len(seen.name)]
            assert list(message.values) == [*seen.position, *done.effort]
            compared += 1
    assert compared >= 10


def test_a_broadcaster_without_a_controller_says_so(neighbour: Neighbour, broadcast: BroadcastNode) -> None:
    until(lambda: neighbour.said["broadcast"][0] == "the controller publishes no steps")


def test_the_types_on_the_wire_have_the_hashes_of_their_definitions(
    neighbour: Neighbour, broadcast: BroadcastNode
) -> None:
    definitions = Definitions()
    for topic, kind in (("names", "Keys"), ("values", "Float64Values")):
        name = f"{NAMESPACE}/broadcast/{topic}"
        until(lambda name=name: bool(neighbour.node.get_publishers_info_by_topic(name)))
        (info,) = neighbour.node.get_publishers_info_by_topic(name)
        assert str(info.topic_type_hash) == f"RIHS01_{definitions.hash_of(f'control_msgs/msg/{kind}')}"
