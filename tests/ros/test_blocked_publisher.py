"""A node that dies or hangs never keeps another one from publishing: a controller does not wait for a recorder."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from tests.conftest import RosDomain

# Twelve topics at 100 Hz, and the longest time that one round of publications took [s].
PUBLISHER = """
import sys, time
from rclpy.node import Node
from std_msgs.msg import String
from fulmar_ros.runtime import init_ros
init_ros()
node, longest = Node("publisher"), 0.0
topics = [node.create_publisher(String, f"topic_{i}", 10) for i in range(12)]
print("ready", flush=True)
end = time.monotonic() + float(sys.argv[1])
while time.monotonic() < end:
    began = time.monotonic()
    for topic in topics:
        topic.publish(String(data="x" * 300))
    longest = max(longest, time.monotonic() - began)
    time.sleep(0.01)
print(longest)
"""
SUBSCRIBER = """
import rclpy
from rclpy.node import Node
from std_msgs.msg import String
from fulmar_ros.runtime import init_ros
init_ros()
node, came = Node("subscriber"), []
for i in range(12):
    node.create_subscription(String, f"topic_{i}", came.append, 10)
while not came:
    rclpy.spin_once(node)
print("received", flush=True)
rclpy.spin(node)
"""
# [s] after a kill until the next one starts: what a launcher takes, and around it
PAUSES = (0.2, 0.6, 1.0, 1.4, 1.8, 2.2, 2.6, 3.0)
STOPPED_S, RECEIVING_S = 2.0, 2.0
ALLOWED_S = 0.15  # a third of the shortest watchdog; in shared memory half of the stops cost 2 s


@contextmanager
def node(code: str, env: dict[str, str], *arguments: str) -> Iterator[subprocess.Popen[str]]:
    """A process that has begun; it is gone afterwards."""
    command = [sys.executable, "-c", code, *arguments]
    with subprocess.Popen(command, env=env, stdout=subprocess.PIPE, text=True) as child:
        try:
            assert child.stdout is not None
            assert child.stdout.readline()
            yield child
        finally:
            child.kill()


@pytest.mark.slow
def test_a_subscriber_that_is_stopped_and_killed_blocks_no_publisher(ros_domain: RosDomain) -> None:
    lasts_s = sum(PAUSES) + len(PAUSES) * (STOPPED_S + RECEIVING_S + 3.0)
    with node(PUBLISHER, ros_domain.env, f"{lasts_s}") as publisher:
        for pause in PAUSES:
            with node(SUBSCRIBER, ros_domain.env) as subscriber:
                time.sleep(RECEIVING_S)
                subscriber.send_signal(signal.SIGSTOP)
                time.sleep(STOPPED_S)
            time.sleep(pause)
        longest = float(publisher.communicate(timeout=lasts_s)[0])
    assert longest < ALLOWED_S
