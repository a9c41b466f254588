"""Robots and controllers of other stacks: our commands reach theirs, and theirs reach ours through the adapter."""

from __future__ import annotations

import time

import pytest
from geometry_msgs.msg import Twist
from std_msgs.msg import ByteMultiArray, Float32MultiArray, Int16MultiArray, UInt8MultiArray

from fulmar_ros.foreign_topics import valve_values
from fulmar_ros.runtime import spinning
from hardware_drivers.adapter_node import AdapterNode
from hardware_drivers.driver_node import DriverNode
from tests.ros.neighbour import Neighbour, until

pytestmark = pytest.mark.real_time


@pytest.fixture
def received(neighbour: Neighbour):
    """Starts a node in this process, and keeps what comes on a topic of another stack."""
    messages: list = []

    def listen(kind: type, topic: str) -> list:
        neighbour.node.create_subscription(kind, topic, messages.append, 10)
        return messages

    return listen


def running(make, namespace: str, *parameters: str, request_exit=lambda _code: None):
    arguments = ["--ros-args", "-r", f"__ns:=/{namespace}"]
    arguments += [word for parameter in parameters for word in ("-p", parameter)]
    node = make(request_exit, cli_args=arguments)
    return node, spinning(node, lambda error: pytest.fail(repr(error)))


def test_our_commands_reach_the_lab_s_valve_node_and_silence_closes_its_valves(neighbour, received) -> None:
    """Entry i after the bearing is thruster ORDER[i]; the node beyond has no watchdog, ours stands before it."""
    messages = received(Int16MultiArray, "/spacer_floating_platform/valves/input")
    node, spin = running(DriverNode, "floating_platform", "hardware:=zero_g_lab_valve_node")
    with spin:
        first = [1.0] + [0.0] * 7
        until(lambda: neighbour.command(first) or (bool(messages) and any(messages[-1].data[1:])))
        assert messages[-1].data.tolist() == [1, 0, 0, 0, 0, 0, 0, 1, 0]
        until(lambda: not any(messages[-1].data[1:]))
        assert messages[-1].data[0] == 1
        node.stop()
        until(lambda: messages[-1].data.tolist() == [0] * 9)  # it is let down


@pytest.mark.parametrize("neighbour", ["turtlebot2"], indirect=True)
def test_our_commands_reach_a_base_that_takes_plain_twists(neighbour, received) -> None:
    messages = received(Twist, "/commands/velocity")
    node, spin = running(DriverNode, "turtlebot2", "robot:=turtlebot2", "hardware:=turtlebot2_kobuki_node")
    with spin:
        until(
            lambda: (
                neighbour.drive.publish(neighbour.twist(0.3, -0.4))
                or (bool(messages) and (messages[-1].linear.x, messages[-1].angular.z) == (0.3, -0.4))
            )
        )
        until(lambda: messages[-1].linear.x == 0.0)
        node.stop()


@pytest.mark.parametrize("neighbour", ["kingfisher"], indirect=True)
def test_our_commands_reach_a_boat_that_takes_two_numbers(neighbour, received) -> None:
    messages = received(Float32MultiArray, "/action")
    node, spin = running(DriverNode, "kingfisher", "robot:=kingfisher", "hardware:=kingfisher_action")
    with spin:
        until(
            lambda: (
                neighbour.command([0.5, -1.0]) or (bool(messages) and list(messages[-1].data) == [0.5, -1.0])
            )
        )
        until(lambda: not any(messages[-1].data))
        node.stop()


@pytest.mark.parametrize(("message", "kind"), [("byte", ByteMultiArray), ("uint8", UInt8MultiArray)])
def test_byte_arrays_with_a_named_order_go_both_ways(neighbour, received, tmp_path, message, kind) -> None:
    """Ours to their valve node, and their controller to ours: entry 1 of RANS's order is thruster 3."""
    files = []
    for name in ("out", "in"):
        files.append(tmp_path / f"{name}.yaml")
        files[-1].write_text(
            "title: t\nrobot: floating_platform\n"
            f"driver: {{kind: valve_topic, topic: /valves/{name}, order: rans, message: {message}}}\n"
        )
    messages = received(kind, "/valves/out")
    node, spin = running(DriverNode, "floating_platform", f"hardware:={files[0]}")
    _adapter, spin_adapter = running(AdapterNode, "floating_platform", f"hardware:={files[1]}")
    neighbour.withdraw_command()  # the plant obeys no two nodes, and the adapter is one
    publisher = neighbour.node.create_publisher(kind, "/valves/in", 1)
    data = [1, 1] + [0] * 7
    theirs = kind(data=[bytes([value]) for value in data] if kind is ByteMultiArray else data)
    with spin, spin_adapter:
        # Their controller drives ours through the adapter, and our driver passes the same on to their valve node.
        until(lambda: publisher.publish(theirs) or any(valve_values(m) == data for m in messages))
        assert any(c.tolist() == [0, 0, 1, 0, 0, 0, 0, 0] for c in neighbour.commands)
        node.stop()


@pytest.mark.parametrize(
    ("data", "commanded"),
    [
        ([1, 1, 0, 0, 0, 1, 0, 0, 0], [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]),
        ([1, 2, 0, 0, 0, 0, 0, 0, 0], None),
        ([1] * 8, None),
    ],
)
def test_the_lab_s_controllers_command_our_valves_through_the_adapter(neighbour, data, commanded) -> None:
    _node, spin = running(AdapterNode, "floating_platform", "hardware:=zero_g_lab_valve_node")
    publisher = neighbour.node.create_publisher(Int16MultiArray, "/spacer_floating_platform/valves/input", 1)
    good = Int16MultiArray(data=[1] + [0] * 8)
    with spin:
        until(lambda: publisher.publish(good) or bool(neighbour.commands))
        neighbour.commands.clear()
        for _ in range(10):
            publisher.publish(Int16MultiArray(data=data))
            time.sleep(0.02)
        found = [command for command in neighbour.commands if command.any()]
        assert all(command.tolist() == commanded for command in found)
        assert bool(found) is (commanded is not None)


def test_an_adapter_that_receives_our_own_driver_passes_nothing_on_and_ends(neighbour, received) -> None:
    """Both of one hardware file: what the driver publishes would come back as a command and feed its watchdog."""
    ended: list[int] = []
    received(
        Int16MultiArray, "/spacer_floating_platform/valves/input"
    )  # the valve node, which the driver waits for
    file = "hardware:=zero_g_lab_valve_node"
    node, spin = running(DriverNode, "floating_platform", file)
    _adapter, spin_adapter = running(AdapterNode, "floating_platform", file, request_exit=ended.append)
    with spin:
        with spin_adapter:
            until(lambda: bool(ended))
        assert set(ended) == {2}
        first = [1.0] + [0.0] * 7
        until(lambda: neighbour.command(first) or bool(neighbour.applied and neighbour.applied[-1].any()))
        until(lambda: not neighbour.applied[-1].any())
        node.stop()


@pytest.mark.parametrize("neighbour", ["kingfisher"], indirect=True)
@pytest.mark.parametrize(
    ("data", "taken"), [([0.5, -0.25], True), ([0.5], False), ([float("nan"), 0.0], False)]
)
def test_roboran_s_boats_command_ours_through_the_adapter(neighbour, data, taken) -> None:
    _node, spin = running(AdapterNode, "kingfisher", "hardware:=kingfisher_action")
    publisher = neighbour.node.create_publisher(Float32MultiArray, "/action", 1)
    with spin:
        until(lambda: publisher.publish(Float32MultiArray(data=[0.0, 0.0])) or bool(neighbour.commands))
        for _ in range(10):
            publisher.publish(Float32MultiArray(data=data))
            time.sleep(0.02)
        assert any(command.any() for command in neighbour.commands) is taken
