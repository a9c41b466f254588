"""Nodes that are served in a thread: what a callback raises reaches the owner of the node."""

from __future__ import annotations

import threading

import pytest
import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from fulmar_ros import runtime
from fulmar_ros.runtime import spinning
from tests.conftest import RosDomain


@pytest.fixture
def node(ros_domain: RosDomain) -> Node:
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    yield rclpy.create_node("raiser")
    rclpy.try_shutdown()


def test_an_error_of_a_callback_reaches_the_owner(node: Node) -> None:
    raised, errors = threading.Event(), []

    def fail() -> None:
        raise ZeroDivisionError("no gain today")

    def keep(error: Exception) -> None:
        errors.append(error)
        raised.set()

    node.create_timer(0.01, fail)
    with spinning(node, keep):
        assert raised.wait(8.0)
    assert [repr(error) for error in errors] == ["ZeroDivisionError('no gain today')"]


@pytest.mark.parametrize("ended", [False, True])
def test_a_destroyed_publisher_is_an_error_only_while_the_node_is_served(
    node: Node, ended: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A callback that outlasts the service of its node publishes into nothing."""
    begun, release, errors = threading.Event(), threading.Event(), []

    def publish_late() -> None:
        begun.set()
        assert release.wait(8.0)
        raise runtime.InvalidHandle("cannot use Destroyable because destruction was requested")

    node.create_timer(0.01, publish_late)
    with spinning(node, errors.append):
        assert begun.wait(8.0)
        thread = next(one for one in threading.enumerate() if one.name == "raiser executor")
        if ended:
            monkeypatch.setattr(thread, "join", lambda timeout: release.set())
        else:
            release.set()
            thread.join(8.0)
    threading.Thread.join(thread, 8.0)
    assert len(errors) == (0 if ended else 1)
