"""The plant's diagnostics say whether the e-stop holds the robot, and who pressed it."""

from __future__ import annotations

import socket
import time
from collections.abc import Iterator

import pytest
from rclpy.node import Node
from std_msgs.msg import Bool
from std_srvs.srv import Trigger

from fulmar_bringup.estop_robots import release_without_node, stop_robots
from fulmar_core.robots.topics import ESTOP, ESTOP_RESET, ESTOP_TRIGGER
from fulmar_ros.estop_node import EstopNode
from fulmar_ros.plant_node import PlantNode
from fulmar_ros.qos import publisher_qos
from fulmar_ros.runtime import spinning
from tests.ros.neighbour import NAMESPACE, ROBOT, Neighbour, until

pytestmark = pytest.mark.real_time


def said(neighbour: Neighbour, key: str) -> str:
    return neighbour.said["plant"][1].get(key, "?")


def press_once(node: Node) -> None:
    publisher = node.create_publisher(Bool, f"{NAMESPACE}/{ESTOP.name}", publisher_qos(ESTOP))
    until(lambda: publisher.get_subscription_count() > 0)
    time.sleep(0.1)
    publisher.publish(Bool(data=True))


@pytest.fixture
def stranger(neighbour: Neighbour) -> Iterator[Node]:
    node = Node("stranger")
    yield node
    node.destroy_node()


def test_a_plant_without_a_press_says_that_no_e_stop_holds_it(neighbour: Neighbour, plant: PlantNode) -> None:
    until(lambda: said(neighbour, "estop") == "false")
    assert said(neighbour, "estop_by") == ""


def test_the_node_that_presses_without_saying_so_is_named_by_the_graph_until_the_reset(
    neighbour: Neighbour, plant: PlantNode, stranger: Node
) -> None:
    press_once(stranger)
    until(lambda: (said(neighbour, "estop"), said(neighbour, "estop_by")) == ("true", "/stranger"))
    assert release_without_node(neighbour.node, NAMESPACE)[0]
    until(lambda: (said(neighbour, "estop"), said(neighbour, "estop_by")) == ("false", ""))


def test_a_press_beside_an_e_stop_node_that_says_nothing_of_it_is_not_taken_for_its_own(
    neighbour: Neighbour, plant: PlantNode, stranger: Node
) -> None:
    button = EstopNode(lambda _code: None, cli_args=["--ros-args", "-r", f"__ns:={NAMESPACE}"])
    with spinning(button, lambda error: pytest.fail(repr(error))):
        press_once(stranger)
        until(lambda: said(neighbour, "estop_by") == "/stranger")


def test_who_presses_by_the_command_is_named_with_its_host(neighbour: Neighbour, plant: PlantNode) -> None:
    assert stop_robots(neighbour.node, ROBOT, find_s=5.0)[0].reached
    until(lambda: said(neighbour, "estop_by") == f"{NAMESPACE}/neighbour on {socket.gethostname()}")


def test_a_press_by_the_service_names_the_e_stop_node_and_a_reset_forgets_it(
    neighbour: Neighbour, plant: PlantNode
) -> None:
    button = EstopNode(lambda _code: None, cli_args=["--ros-args", "-r", f"__ns:={NAMESPACE}"])
    with spinning(button, lambda error: pytest.fail(repr(error))):
        until(lambda: said(neighbour, "estop") == "false")
        for service, expected in ((ESTOP_TRIGGER, "by its service"), (ESTOP_RESET, "")):
            client = neighbour.node.create_client(Trigger, service)
            assert client.wait_for_service(8.0)
            future = client.call_async(Trigger.Request())
            until(future.done)
            assert future.result().success
            until(lambda words=expected: said(neighbour, "estop_by").endswith(words) and (
                said(neighbour, "estop") == ("true" if words else "false")
            ))  # fmt: skip


def test_the_silence_of_an_e_stop_node_holds_the_robot_and_is_no_press_of_any_node(
    neighbour: Neighbour, plant: PlantNode, stranger: Node
) -> None:
    publisher = stranger.create_publisher(Bool, f"{NAMESPACE}/{ESTOP.name}", publisher_qos(ESTOP))

    def alive() -> bool:
        publisher.publish(Bool(data=False))
        return publisher.get_subscription_count() > 0

    until(alive)
    time.sleep(0.1)
    publisher.publish(Bool(data=False))
    until(lambda: said(neighbour, "estop") == "true")
    assert said(neighbour, "estop_by") == ""
