"""Single nodes with their neighbour, and recorders with what they receive, each in a ROS domain of its own."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from fulmar_core.robots.topics import DIAGNOSTICS
from fulmar_ros.controller_node import ControllerNode
from fulmar_ros.plant_node import PlantNode
from fulmar_ros.qos import subscriber_qos
from fulmar_ros.runtime import spinning
from sim_nodes.sim_node import make_backend
from tests.conftest import RosDomain
from tests.ros.controllers import make_lqr
from tests.ros.neighbour import NAMESPACE, ROBOT, Neighbour, Stream, until
from tests.ros.recorder import Recorder


@pytest.fixture
def neighbour(ros_domain: RosDomain, request: pytest.FixtureRequest) -> Iterator[Neighbour]:
    """Beside the floating platform, or the robot that a test names."""
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    other = Neighbour(getattr(request, "param", ROBOT))
    with spinning(other.node, lambda error: pytest.fail(repr(error))):
        yield other
    rclpy.try_shutdown()


@pytest.fixture
def plant(neighbour: Neighbour) -> Iterator[PlantNode]:
    """A real-time plant on the mock backend."""
    arguments = ["--ros-args", "-r", f"__ns:={NAMESPACE}", "-p", "backend:=mock"]
    node = PlantNode(make_backend, lambda _code: None, cli_args=arguments)
    with spinning(node, lambda error: pytest.fail(repr(error))):
        until(lambda: bool(neighbour.applied))
        yield node
        node.stop()


@pytest.fixture
def controller(
    neighbour: Neighbour, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> Iterator[ControllerNode]:
    """A real-time LQR node at 50 Hz, with the parameters that a test adds."""
    monkeypatch.setattr(sys, "argv", ["controller_node"])
    arguments = ["--ros-args", "-r", f"__ns:={NAMESPACE}", "-p", "control_hz:=50.0"]
    for parameter in getattr(request, "param", ()):
        arguments += ["-p", parameter]
    node = ControllerNode(make_lqr, lambda _code: None, cli_args=arguments)
    with spinning(node, lambda error: pytest.fail(repr(error))):
        neighbour.give_goal()
        until(lambda: "controller" in neighbour.said)
        yield node
        node.stop()


@pytest.fixture
def stream(neighbour: Neighbour, controller: ControllerNode) -> Iterator[Stream]:
    """Good odometry, with the controller acting on it."""
    odometry = Stream(neighbour)
    until(lambda: bool(neighbour.commands) and neighbour.commands[-1].any())
    yield odometry
    odometry.stop()


@pytest.fixture
def record(ros_domain, tmp_path) -> Iterator[object]:
    """Starts recorders, each a process; none outlives its test."""
    started = []

    def start(*parameters: str, directory: Path | None = None) -> Recorder:
        started.append(Recorder(directory or tmp_path / "bag", ros_domain.env, *parameters))
        return started[-1]

    yield start
    for recorder in started:
        recorder.process.kill()
        recorder.process.communicate()


@pytest.fixture
def node(ros_domain) -> Iterator[Node]:
    """Who talks to the recorder, and receives it."""
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=ros_domain.id)
    made = rclpy.create_node("talker", namespace=NAMESPACE, context=context)
    yield made
    made.destroy_node()
    rclpy.shutdown(context=context)


@pytest.fixture
def healths(node) -> Iterator[list[DiagnosticStatus]]:
    """What the recorder said about itself, newest last."""
    received: list[DiagnosticStatus] = []
    node.create_subscription(
        DiagnosticArray,
        DIAGNOSTICS.name,
        lambda message: received.extend(message.status),
        subscriber_qos(DIAGNOSTICS),
    )
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    thread = threading.Thread(target=executor.spin)
    thread.start()
    yield received
    executor.shutdown()
    thread.join()
