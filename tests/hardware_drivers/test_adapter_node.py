"""Commands of other stacks and ours as messages, both ways, with nodes that nobody serves."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rclpy
from geometry_msgs.msg import Twist
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import ByteMultiArray, Float32MultiArray, Int16MultiArray, UInt8MultiArray

from fulmar_core.robots.robot_file import load_robot
from hardware_drivers.adapter_node import AdapterNode
from hardware_drivers.driver_node import DriverNode
from hardware_drivers.hardware import load_hardware
from tests.conftest import RosDomain
from tests.ros.neighbour import until


@pytest.fixture
def ros(ros_domain: RosDomain) -> Iterator[None]:
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    yield
    rclpy.try_shutdown()


def passed_on(hardware: object, message: Any, robot: str = "floating_platform") -> list[list[float]]:
    """What an adapter commands after one message."""
    node: Any = AdapterNode(
        lambda _code: None, cli_args=["--ros-args", "-r", f"__ns:=/{robot}", "-p", f"hardware:={hardware}"]
    )
    sent: list[list[float]] = []
    node._publisher.publish = lambda command: sent.append(list(command.effort))
    node._receive(message)
    node.destroy_node()
    return sent


@pytest.mark.parametrize(
    ("data", "commanded"),
    [
        ([1, 1, 0, 0, 0, 1, 0, 0, 0], [[0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]]),
        ([1, 2, 0, 0, 0, 0, 0, 0, 0], []),
        ([1] * 8, []),
    ],
)
def test_the_lab_s_controllers_command_our_valves(ros: None, data: list[int], commanded: list) -> None:
    assert passed_on("zero_g_lab_valve_node", Int16MultiArray(data=data)) == commanded


@pytest.mark.parametrize(
    ("data", "commanded"), [([0.5, -0.25], [[0.5, -0.25]]), ([0.5], []), ([float("nan"), 0.0], [])]
)
def test_roboran_s_boats_command_ours(ros: None, data: list[float], commanded: list) -> None:
    assert passed_on("kingfisher_action", Float32MultiArray(data=data), "kingfisher") == commanded


@pytest.mark.parametrize(("message", "kind"), [("byte", ByteMultiArray), ("uint8", UInt8MultiArray)])
def test_byte_arrays_with_a_named_order_are_read(ros: None, tmp_path: Path, message: str, kind: type) -> None:
    """Entry 1 of RANS's order is thruster 3."""
    file = tmp_path / "in.yaml"
    file.write_text(
        "title: t\nrobot: floating_platform\n"
        f"driver: {{kind: valve_topic, topic: /valves, order: rans, message: {message}}}\n"
    )
    data = [1, 1] + [0] * 7
    theirs = kind(data=[bytes([value]) for value in data] if kind is ByteMultiArray else data)
    assert passed_on(file, theirs) == [[0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]]


def sent_by_driver(robot: str, hardware: object, kind: type, command: list[float]) -> Any:
    """The message that a driver node's backend publishes of one command."""
    listener = rclpy.create_node("listener")
    topic, got = load_hardware(str(hardware)).driver.topic, []
    listener.create_subscription(kind, topic, got.append, 10)
    arguments = ["-r", f"__ns:=/{robot}", "-p", f"robot:={robot}", "-p", f"hardware:={hardware}"]
    node: Any = DriverNode(lambda _code: None, cli_args=["--ros-args", *arguments, "-p", "autostart:=false"])
    backend = node._by_topic(load_robot(robot), load_hardware(str(hardware)), 5.0)

    def received() -> bool:
        backend.step(np.array(command))
        rclpy.spin_once(listener, timeout_sec=0.05)
        return bool(got)

    until(received)
    node.destroy_node()
    listener.destroy_node()
    return got[0]


def test_our_commands_reach_a_base_that_takes_plain_twists(ros: None) -> None:
    twist = sent_by_driver("turtlebot2", "turtlebot2_kobuki_node", Twist, [0.3, -0.4])
    assert (twist.linear.x, twist.angular.z) == (0.3, -0.4)


def test_our_commands_reach_a_boat_that_takes_two_numbers(ros: None) -> None:
    sent = sent_by_driver("kingfisher", "kingfisher_action", Float32MultiArray, [0.5, -1.0])
    assert list(sent.data) == [0.5, -1.0]


def test_our_commands_reach_a_valve_node_that_takes_bytes_without_a_sign(ros: None, tmp_path: Path) -> None:
    file = tmp_path / "out.yaml"
    file.write_text(
        "title: t\nrobot: floating_platform\n"
        "driver: {kind: valve_topic, topic: /valves, order: rans, message: uint8}\n"
    )
    sent = sent_by_driver("floating_platform", file, UInt8MultiArray, [0.0, 0.0, 1.0] + [0.0] * 5)
    assert list(sent.data) == [1, 1] + [0] * 7
