"""Every wire that a node subscribes, against publishers of every quality of service."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.context import Context
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from fulmar_core.controllers.law import Law
from fulmar_core.loop.controller_settings import ControllerSettings
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.topics import DIAGNOSTICS, ESTOP, GOAL_POSE, IMU, OBSTACLES, SWAP, Wire
from fulmar_core.tasks import Task, load_task
from fulmar_ros.controller_node import ControllerNode
from fulmar_ros.estimator_node import EstimatorNode
from fulmar_ros.estop_node import EstopNode
from fulmar_ros.goal_node import GoalNode
from fulmar_ros.markers_node import MarkersNode
from fulmar_ros.message_class import message_class
from fulmar_ros.operator_subscription import subscribe_every
from fulmar_ros.plant_node import PlantNode
from fulmar_ros.qos import publisher_qos
from fulmar_ros.recorder_node import RecorderNode
from fulmar_ros.runtime import spinning
from fulmar_ros.teleop_node import TeleopNode
from sim_nodes.event_camera_node import EventCameraNode
from sim_nodes.sim_node import make_backend
from tests.conftest import RosDomain
from tests.ros.controllers import make_classical
from tests.ros.neighbour import until

OFFERS = {
    f"{reliability.name} {durability.name}": QoSProfile(
        depth=10, reliability=reliability, durability=durability
    )
    for reliability, durability in itertools.product(
        (ReliabilityPolicy.BEST_EFFORT, ReliabilityPolicy.RELIABLE),
        (DurabilityPolicy.VOLATILE, DurabilityPolicy.TRANSIENT_LOCAL),
    )
}
BEST_EFFORT = [name for name in OFFERS if name.startswith("BEST_EFFORT")]
OF_ROS = ("/parameter_events", "/rosout")
ESTIMATORS = {
    "mocap_imu": "floating_platform", "mocap_imu_3d": "spacecraft_16", "attitude": "cubesat_wheels",
    "inertia": "cubesat_wheels", "event_rate": "cubesat_wheels",
}  # fmt: skip
CONTROLLED = {
    "floating_platform": "go_to_pose", "turtlebot2": "push_block", "kingfisher": "go_to_position_with_obstacles",
    "cubesat_wheels": "slew", "airship_v7": "fly_hold",
}  # fmt: skip
Make = Callable[[list[str]], Node]


def _code(_code: int) -> None: ...


def nodes() -> dict[str, tuple[Make, list[str]]]:
    """Every node that subscribes wires, with its parameters."""
    made: dict[str, tuple[Make, list[str]]] = {
        "plant": (lambda words: PlantNode(make_backend, _code, cli_args=words), ["backend:=mock"]),
        "estop": (lambda words: EstopNode(_code, cli_args=words), []),
        "goals": (lambda words: GoalNode(_code, cli_args=words), ["goals:=lab_circle"]),
        "teleop": (lambda words: TeleopNode(_code, cli_args=words), ["keyboard:=false"]),
        "markers": (_markers, []),
        "recorder": (lambda words: RecorderNode(_code, cli_args=words), ["directory:=bag"]),
        "camera": (lambda words: EventCameraNode(_code, cli_args=words), ["robot:=cubesat_wheels"]),
    }
    for estimator, robot in ESTIMATORS.items():
        parameters = [f"robot:={robot}", f"estimator:={estimator}"]
        made[f"estimator {estimator}"] = (lambda words: EstimatorNode(_code, cli_args=words), parameters)
    for robot, task in CONTROLLED.items():
        parameters = [f"robot:={robot}", f"task:={task}"]
        made[f"controller {robot}"] = (_controller, parameters)
    return made


def _controller(words: list[str]) -> Node:
    """With the law of the robot's family; of pushing there is none, and its wires do not depend on the law."""

    def make(robot: Robot, task: Task, settings: ControllerSettings) -> Law:
        return make_classical(robot, load_task("go_to_pose") if task.things else task, settings)

    return ControllerNode(make, _code, cli_args=words)


def _markers(words: list[str]) -> Node:
    node = MarkersNode(_code, cli_args=words)
    node._subscribe()  # as it does once a plant runs
    return node


@pytest.fixture
def other(ros_domain: RosDomain) -> Iterator[Node]:
    """A node of another process, as far as the middleware knows."""
    rclpy.init(args=[])
    context = Context()
    rclpy.init(context=context, domain_id=ros_domain.id)
    node = rclpy.create_node("other", namespace="/boat", context=context)
    yield node
    node.destroy_node()
    rclpy.shutdown(context=context)
    rclpy.try_shutdown()


def arguments(parameters: list[str]) -> list[str]:
    return ["--ros-args", "-r", "__ns:=/boat", *(word for one in parameters for word in ("-p", one))]


def unheard(other: Node, wanted: dict[str, type]) -> set[str]:
    """Publishers of all qualities from which no subscription of a topic receives, after some seconds."""
    offered: dict[str, Publisher] = {
        f"{topic}: {name}": other.create_publisher(kind, topic, qos)
        for topic, kind in wanted.items()
        for name, qos in OFFERS.items()
    }
    end, missing = time.monotonic() + 6.0, set(offered)
    while missing and time.monotonic() < end:
        missing = {name for name in missing if not offered[name].get_subscription_count()}
        time.sleep(0.02)
    return missing


QUICK = {
    "plant",
    "recorder",
    "goals",
    "estimator mocap_imu",
    "controller floating_platform",
}  # one of each kind


@pytest.mark.parametrize(
    "name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in nodes()]
)
def test_a_node_receives_each_of_its_wires_from_publishers_of_every_quality(
    name: str, other: Node, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", [name])
    make, parameters = nodes()[name]
    node = make(arguments(parameters))
    wanted = {each.topic_name: each.msg_type for each in node.subscriptions if each.topic_name not in OF_ROS}
    with spinning(node, lambda error: pytest.fail(repr(error))):
        assert len(wanted) >= 1
        assert unheard(other, wanted) == set()
        if hasattr(node, "stop"):
            node.stop()


@pytest.mark.parametrize(
    "wire",
    [ESTOP, IMU, pytest.param(SWAP, marks=pytest.mark.slow)],
    ids=lambda wire: getattr(wire, "name", ""),
)
@pytest.mark.parametrize("offer", OFFERS)
def test_a_message_of_every_quality_comes_once(wire: Any, offer: str, other: Node) -> None:
    kind = message_class(wire)
    assert kind is not None
    node, got = rclpy.create_node("listener", namespace="/boat"), []
    subscribe_every(node, kind, wire, lambda message: got.append(bytes(message)), raw=True)
    with spinning(node, lambda error: pytest.fail(repr(error))):
        publisher = other.create_publisher(kind, wire.name, OFFERS[offer])
        until(lambda: publisher.get_subscription_count() > 0)
        reliable_too = other.create_publisher(kind, wire.name, OFFERS["RELIABLE VOLATILE"])
        until(lambda: reliable_too.get_subscription_count() > 0)
        time.sleep(0.3)  # until each side knows the other
        for _ in range(10):
            publisher.publish(kind())
            reliable_too.publish(kind())
            time.sleep(0.005)
        until(lambda: len(got) >= 20)
        time.sleep(0.1)
        assert len(got) == 20


@pytest.mark.parametrize("wire", [GOAL_POSE, OBSTACLES], ids=lambda wire: wire.name)
def test_a_plain_publisher_of_an_operator_s_wire_is_warned_of_nothing_and_a_latched_one_is_received_late(
    wire: Wire, other: Node
) -> None:
    kind = message_class(wire)
    assert kind is not None
    early = other.create_publisher(kind, wire.name, publisher_qos(wire))
    node, plain, got = rclpy.create_node("listener", namespace="/boat"), f"/boat/plain/{wire.name}", []
    subscribe_every(node, kind, wire, got.append, topic=plain)
    warned: list[Any] = []
    events = PublisherEventCallbacks(incompatible_qos=warned.append)
    with spinning(node, lambda error: pytest.fail(repr(error))), spinning(other, lambda _error: None):
        publisher = other.create_publisher(kind, plain, 10, event_callbacks=events)
        until(lambda: publisher.get_subscription_count() > 0)
        publisher.publish(kind())
        until(lambda: len(got) == 1)
        assert warned == []
        early.publish(kind())
        subscribe_every(node, kind, wire, got.append)
        until(lambda: len(got) == 2)


def test_a_best_effort_publisher_is_named_by_an_estimator_in_lock_step_which_counts_messages(
    other: Node, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[str] = []

    def keep(message: DiagnosticArray) -> None:
        said.extend(pair.value for status in message.status for pair in status.values)

    node = EstimatorNode(_code, cli_args=arguments(["robot:=floating_platform", "lockstep:=true"]))
    listener = rclpy.create_node("listener", namespace="/boat")
    subscribe_every(listener, DiagnosticArray, DIAGNOSTICS, keep)
    other.create_publisher(message_class(IMU), IMU.name, OFFERS["BEST_EFFORT VOLATILE"])
    words = "/boat/other publishes best effort on /boat/imu/data, must be reliable: nothing of it arrives"
    with spinning(node, lambda error: pytest.fail(repr(error))), spinning(listener, lambda _error: None):
        until(lambda: words in said)
