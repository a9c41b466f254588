"""Nodes that are served in a thread: what a callback raises reaches the owner of the node."""

from __future__ import annotations

import subprocess
import sys
import threading
import time

import pytest
import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import Bool

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


def test_a_publisher_that_another_thread_destroys_while_its_event_comes_ends_nothing(node: Node) -> None:
    """Each publisher meets a latched subscription, which its QoS does not satisfy: an event that rclpy then takes."""
    errors: list[Exception] = []
    other = rclpy.create_node("latched")
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    subscriptions = [other.create_subscription(Bool, "estop", lambda _: None, latched) for _ in range(3)]
    with spinning(node, errors.append), spinning(other, errors.append):
        for number in range(100):
            publisher = node.create_publisher(Bool, "estop", 10)
            time.sleep(0.0005 * (number % 8))  # events come some of 0 to 4 ms later
            node.destroy_publisher(publisher)
        served = threading.Event()
        node.create_timer(0.01, served.set)
        assert served.wait(8.0)
    assert subscriptions and errors == []


SIGNAL_GOES_TO_ANOTHER_THREAD = """
import signal, sys
from rclpy.node import Node
from fulmar_ros import runtime

def block() -> None:
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM})
    print("ready", flush=True)

runtime.settle_memory = block
sys.exit(runtime.run_node(lambda _exit: Node("quiet")))
"""


def test_a_node_ends_in_order_whichever_thread_the_signal_goes_to(ros_domain: RosDomain) -> None:
    command = [sys.executable, "-c", SIGNAL_GOES_TO_ANOTHER_THREAD]
    with subprocess.Popen(command, env=ros_domain.env, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None and process.stdout.readline() == "ready\n"
            process.terminate()
            assert process.wait(10.0) == 0
        finally:
            process.kill()


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
