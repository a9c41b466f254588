"""How processes of Fulmar find and reach each other."""

from __future__ import annotations

import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

from tests.conftest import RosDomain

NODE = """
from fulmar_ros.middleware import set_up_middleware
set_up_middleware()
import rclpy
from nav_msgs.msg import Odometry
rclpy.init()
node = rclpy.create_node("talker")
publisher = node.create_publisher(Odometry, "odom", 10)
print("ready", flush=True)
input()
"""
NOBODY = 25  # number of a participant that is not there; its port is reported of everybody all the same


@contextmanager
def node(env: dict[str, str]) -> Iterator[subprocess.Popen[str]]:
    """A node in a process of its own, once it is there."""
    plain = {name: value for name, value in env.items() if not name.startswith(("FASTDDS_", "FASTRTPS_"))}
    command = [sys.executable, "-c", NODE]
    with subprocess.Popen(
        command, env=plain, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == "ready\n"
        yield child
        child.communicate("\n")


def received(port: socket.socket, seconds: float) -> int:
    """How many datagrams come in so many seconds."""
    count, end = 0, time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0.0:
        port.settimeout(left)
        try:
            port.recv(65536)
        except TimeoutError:
            break
        count += 1
    return count


def test_whoever_misses_the_first_words_of_a_node_soon_receives_of_it(ros_domain: RosDomain) -> None:
    """By itself Fast DDS speaks in the first half second and then every 3 s."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as port:
        port.bind(("127.0.0.1", 7400 + 250 * ros_domain.id + 10 + 2 * NOBODY))  # RTPS 2.2, §9.6.1.1
        with node(ros_domain.env):
            assert received(port, 0.5) >= 1
            received(port, 0.5)
            assert received(port, 1.0) >= 3
