"""Inputs that two nodes publish: no node follows one, it names both, and it goes on when one is gone."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace

import pytest
import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from fulmar_core.robots.topics import AIR_BEARING, IMU, MOCAP, ODOMETRY
from fulmar_core.safety.command_gate import SETTLE_NS, OneWriter
from fulmar_ros import graph
from fulmar_ros.controller_node import ControllerNode
from fulmar_ros.estimator_node import EstimatorNode
from fulmar_ros.graph import NAMING_NS, UNNAMED, WriterWatch
from tests.conftest import RosDomain
from tests.ros.controllers import make_lqr
from tests.ros.neighbour import NAMESPACE

S = 1_000_000_000
BOTH = ["/a", "/b"]


def test_a_topic_of_two_nodes_is_not_followed_until_some_time_after_one_is_gone():
    writer = OneWriter("odom")
    writer.see([], S)
    assert writer.reason(S) == ""
    writer.see(BOTH, 2 * S)
    assert writer.reason(2 * S) == "2 nodes publish odom, and only one may: /a, /b"
    writer.see(["/b"], 3 * S)
    assert writer.reason(2 * S + SETTLE_NS)
    assert writer.reason(2 * S + SETTLE_NS + 1) == ""


def test_a_node_of_unknown_name_holds_at_once_and_is_reported_when_its_name_has_not_come(monkeypatch):
    found = [UNNAMED, "/a"]
    monkeypatch.setattr(graph, "writers_of", lambda _node, _subscription: found)
    watch = WriterWatch(SimpleNamespace(), {"odom": [SimpleNamespace()]})
    words = f"2 nodes publish odom, and only one may: {UNNAMED}, /a"
    assert (watch.look(S), watch.alarm) == (words, "")
    assert (watch.look(S + NAMING_NS), watch.alarm) == (words, "")
    assert (watch.look(S + NAMING_NS + 1), watch.alarm) == (words, words)
    found[:] = BOTH
    assert watch.look(3 * S) == watch.alarm == "2 nodes publish odom, and only one may: /a, /b"


def test_two_nodes_of_an_input_that_is_started_anew_hold_and_are_a_warning_until_one_is_gone(monkeypatch):
    found = {"odom": [], "image": BOTH}
    monkeypatch.setattr(graph, "writers_of", lambda _node, subscription: found[subscription])
    inputs = {"odom": ["odom"], "image": ["image"]}
    watch = WriterWatch(SimpleNamespace(), inputs, restarted=["image"])
    words = "2 nodes publish image, and only one may: /a, /b"
    assert (watch.look(S), watch.alarm, watch.warning) == (words, "", words)
    found["image"] = []
    assert (watch.look(S + SETTLE_NS), watch.alarm, watch.warning) == (words, "", words)
    assert (watch.look(S + SETTLE_NS + 1), watch.alarm, watch.warning) == ("", "", "")
    found.update(odom=BOTH, image=BOTH)
    wrong = "2 nodes publish odom, and only one may: /a, /b"
    assert (watch.look(9 * S), watch.alarm, watch.warning) == (wrong, wrong, words)


@pytest.fixture
def arguments(ros_domain: RosDomain, monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """ROS arguments of a node that nobody serves."""
    monkeypatch.setattr("sys.argv", ["node"])
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    yield ["--ros-args", "-r", f"__ns:={NAMESPACE}"]
    rclpy.try_shutdown()


def written_twice(monkeypatch: pytest.MonkeyPatch, topic: str) -> None:
    def writers(_node: Node, subscription: SimpleNamespace) -> list[str]:
        return BOTH if subscription.topic_name == f"{NAMESPACE}/{topic}" else []

    monkeypatch.setattr(graph, "writers_of", writers)


@pytest.mark.parametrize("wire", [ODOMETRY, AIR_BEARING], ids=lambda wire: wire.name)
def test_a_controller_follows_none_of_its_inputs_that_two_nodes_publish(wire, arguments, monkeypatch):
    node = ControllerNode(make_lqr, lambda _code: None, cli_args=[*arguments, "-p", "lockstep:=true"])
    written_twice(monkeypatch, wire.name)
    node._see_writers()
    assert node.guard.flags.contested == f"2 nodes publish {wire.name}, and only one may: /a, /b"
    node.stop()
    node.destroy_node()


@pytest.mark.parametrize("wire", [MOCAP, IMU], ids=lambda wire: wire.name)
def test_an_estimator_takes_none_of_its_readings_that_two_nodes_publish(wire, arguments, monkeypatch):
    node = EstimatorNode(lambda _code: None, cli_args=arguments)
    written_twice(monkeypatch, wire.name)
    assert node._see_writers() == f"2 nodes publish {wire.name}, and only one may: /a, /b"
    assert not node._take("imu", "whatever it says")
    assert node._refusal.startswith(f"2 nodes publish {wire.name}")
    node.stop()
    node.destroy_node()
