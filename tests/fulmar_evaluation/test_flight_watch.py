"""What counts as safe of an aircraft in the fault suite."""

from __future__ import annotations

import pytest
from nav_msgs.msg import Odometry
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import ACTUATORS_STATE, TRUTH, command_wire
from fulmar_core.wires.robot_name import frames_of
from fulmar_evaluation.faults.flight_watch import FlightWatch
from fulmar_evaluation.faults.observer import RunObserver

CRAFT = load_robot("airship_v7")
CHOSEN, STEERED = [-0.03, 0.001, 0.002, 0.35, 0.36], [-0.02, 0.0, 0.0, 0.3, 0.3]


class Node:
    """Keeps what is subscribed, by topic."""

    def __init__(self) -> None:
        self.listeners = {}

    def create_subscription(self, kind, topic, callback, qos, *, raw=False):
        self.listeners[topic] = callback


@pytest.fixture
def node() -> Node:
    return Node()


def applied(node: Node, values: list[float]) -> None:
    node.listeners[ACTUATORS_STATE.name](JointState(effort=values))


def test_an_aircraft_is_moved_by_what_its_controller_commands_and_safe_with_anything_else(node):
    observer = RunObserver(node, CRAFT)
    applied(node, CHOSEN)
    node.listeners[command_wire(CRAFT).name](JointState(effort=CHOSEN))  # may come after what it leads to
    assert observer.moves()
    applied(node, STEERED)
    assert not observer.moves()
    assert [moves for _, moves in observer.applied_since(0.0)] == [True, False]


def test_neutral_surfaces_that_a_controller_commands_are_not_safe_for_an_aircraft(node):
    observer = RunObserver(node, CRAFT)
    node.listeners[command_wire(CRAFT).name](JointState(effort=[0.0] * 5))
    applied(node, [0.0] * 5)
    assert observer.moves()


def test_whatever_is_applied_to_an_aircraft_that_has_come_down_is_safe(node):
    down = [False]
    observer = RunObserver(node, CRAFT, is_down=lambda: down[0])
    node.listeners[command_wire(CRAFT).name](JointState(effort=[0.0] * 5))
    for down[0] in (False, True):
        applied(node, [0.0] * 5)
    assert [moves for _, moves in observer.applied_since(0.0)] == [True, False]


def test_a_robot_that_can_stop_is_safe_with_the_safe_command_alone(node):
    observer = RunObserver(node, load_robot("floating_platform"))
    applied(node, [0.0] * 8)
    assert not observer.moves()
    applied(node, [1.0, *[0.0] * 7])
    assert observer.moves()


def flown(watch_node: Node, *, climb: float, qx: float = 0.0, speed: float = 28.0) -> None:
    message = Odometry()
    message.header.frame_id, message.child_frame_id = "map", "airship_v7/base_link"
    message.pose.pose.orientation.x, message.pose.pose.orientation.w = qx, (1.0 - qx**2) ** 0.5
    message.twist.twist.linear.x, message.twist.twist.linear.z = speed, climb
    watch_node.listeners[TRUTH.name](serialize_message(message))


@pytest.mark.parametrize(
    ("climb", "qx", "safe"), [(-0.4, 0.0, True), (-1.2, 0.0, False), (-0.1, 0.0958, False), (2.0, 0.05, True)]
)
def test_a_flight_is_safe_with_little_bank_and_sink(node, climb, qx, safe):
    watch = FlightWatch(node, frames_of("airship_v7", "airship_v7"))
    assert watch.since(0.0) == ("no true state was received after the fault", False)
    flown(node, climb=climb, qx=qx)
    words, found = watch.since(0.0)
    assert found is safe, words


def test_a_craft_that_stands_has_come_down(node):
    watch = FlightWatch(node, frames_of("airship_v7", "airship_v7"))
    assert not watch.is_down()
    for speed in (28.0, 0.2):
        flown(node, climb=0.0, speed=speed)
        assert watch.is_down() == (speed < 1.0)
