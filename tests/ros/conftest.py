"""Single nodes with their neighbour, each in a ROS domain of its own."""

from __future__ import annotations

import sys
from collections.abc import Iterator

import pytest
import rclpy
from rclpy.signals import SignalHandlerOptions

from fulmar_ros.controller_node import ControllerNode
from fulmar_ros.plant_node import PlantNode
from fulmar_ros.runtime import spinning
from policy_server.lqr_node import make_lqr
from sim_nodes.sim_node import make_backend
from tests.conftest import RosDomain
from tests.ros.neighbour import NAMESPACE, ROBOT, Neighbour, Stream, until


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
def controller(neighbour: Neighbour, monkeypatch: pytest.MonkeyPatch) -> Iterator[ControllerNode]:
    """A real-time LQR node at 50 Hz."""
    monkeypatch.setattr(sys, "argv", ["lqr_node"])
    arguments = ["--ros-args", "-r", f"__ns:={NAMESPACE}", "-p", "control_hz:=50.0"]
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
