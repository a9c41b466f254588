"""Robots and controllers of other stacks: our commands reach theirs, and theirs reach ours through the adapter.

Other messages stand in tests/hardware_drivers/test_adapter_node.py.
"""

from __future__ import annotations

import pytest
from std_msgs.msg import ByteMultiArray, Int16MultiArray

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


def test_byte_arrays_with_a_named_order_go_both_ways(neighbour, received, tmp_path) -> None:
    """Ours to their valve node, and their controller to ours: entry 1 of RANS's order is thruster 3."""
    files = []
    for name in ("out", "in"):
        files.append(tmp_path / f"{name}.yaml")
        files[-1].write_text(
            "title: t\nrobot: floating_platform\n"
            f"driver: {{kind: valve_topic, topic: /valves/{name}, order: rans, message: byte}}\n"
        )
    messages = received(ByteMultiArray, "/valves/out")
    node, spin = running(DriverNode, "floating_platform", f"hardware:={files[0]}")
    _adapter, spin_adapter = running(AdapterNode, "floating_platform", f"hardware:={files[1]}")
    neighbour.withdraw_command()  # the plant obeys no two nodes, and the adapter is one
    publisher = neighbour.node.create_publisher(ByteMultiArray, "/valves/in", 1)
    data = [1, 1] + [0] * 7
    theirs = ByteMultiArray(data=[bytes([value]) for value in data])
    with spin, spin_adapter:
        # Their controller drives ours through the adapter, and our driver passes the same on to their valve node.
        until(lambda: publisher.publish(theirs) or any(valve_values(m) == data for m in messages))
        assert any(c.tolist() == [0, 0, 1, 0, 0, 0, 0, 0] for c in neighbour.commands)
        node.stop()


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
