"""What another host of the network can do to a robot, with two network namespaces as two hosts."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import psutil
import pytest

from fulmar_evaluation.faults.two_hosts import TwoHosts, inside, two_hosts, why_not
from fulmar_ros.middleware import (
    DISCOVERY_RANGE,
    PROFILES,
    STATIC_PEERS,
    environment_of_any_node,
)
from tests.conftest import RosDomain
from tests.ros.split_parts import in_container

pytestmark = pytest.mark.skipif(bool(why_not()), reason=why_not())
ROBOT, STRANGER = "10.77.0.1", "10.77.0.2"  # addresses of the two hosts
# The wires by which a robot is commanded; both sides know them by name and type.
WIRES = """
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, String
WIRES = {"goal_pose": PoseStamped, "actuators/command": JointState, "controller/swap": String,
         "estop": Bool, "estop/released": String}
"""
VICTIM = f"""{WIRES}
import sys
from fulmar_ros.runtime import ros_node
received = set()
with ros_node("victim", lambda error: None, namespace="/boat") as node:
    for name, kind in WIRES.items():
        node.create_subscription(kind, name, lambda _message, name=name: received.add(name), 10)
    print("ready", flush=True)
    sys.stdin.readline()
print(" ".join(sorted(received)), flush=True)
"""
ATTACK = f"""{WIRES}
import time
import rclpy
INIT
node = rclpy.create_node("stranger", namespace="/boat")
publishers = [node.create_publisher(kind, name, 10) for name, kind in WIRES.items()]
end = time.monotonic() + SECONDS
while time.monotonic() < end:
    for publisher in publishers:
        publisher.publish(publisher.msg_type())
    rclpy.spin_once(node, timeout_sec=0.1)
"""
NOT_OURS = """
import sys
import rclpy
rclpy.init()
node = rclpy.create_node("own", namespace="/boat")
print("ready", flush=True)
sys.stdin.readline()
"""
ALL = "actuators/command controller/swap estop estop/released goal_pose"
PLAIN = "rclpy.init()"  # no code of Fulmar: whatever speaks ROS 2
OURS = "from fulmar_ros.runtime import init_ros; init_ros()"
SECONDS = 3.0  # of the attack; where it succeeds it takes half a second


@pytest.fixture(scope="module")
def hosts() -> Iterator[TwoHosts]:
    with two_hosts() as made:
        yield made


def environment(domain: RosDomain, **more: str) -> dict[str, str]:
    """An environment in which nothing is set of discovery but what is given."""
    mine = {DISCOVERY_RANGE, STATIC_PEERS, *PROFILES}
    return {name: value for name, value in domain.env.items() if name not in mine} | more


@contextmanager
def victim(hosts: TwoHosts, env: dict[str, str], code: str = VICTIM) -> Iterator[subprocess.Popen[str]]:
    """A node on the robot's host, by default one of Fulmar."""
    command = in_container(hosts.robot, [sys.executable, "-c", code], other_user=False)
    with subprocess.Popen(
        command, env=env, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == "ready\n"
        yield child
        if child.poll() is None:
            child.kill()


def received_from_the_other_host(hosts: TwoHosts, domain: RosDomain, **of_robot: str) -> str:
    """Names of the wires on which a stranger's messages arrive, who knows the robot's address."""
    attacker = environment(domain) | {
        DISCOVERY_RANGE: "SUBNET",
        STATIC_PEERS: ROBOT,
        "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4",
    }
    command = in_container(hosts.other, attack(PLAIN), other_user=False)
    return received(hosts, command, attacker, environment(domain, **of_robot))


def attack(init: str) -> list[str]:
    code = ATTACK.replace("SECONDS", str(SECONDS)).replace("INIT", init)
    return [sys.executable, "-c", code]


def received(hosts: TwoHosts, command: list[str], attacker: dict[str, str], robot: dict[str, str]) -> str:
    """Names of the wires on which the messages of a command arrive."""
    with victim(hosts, robot) as node:
        subprocess.run(command, env=attacker, check=True, timeout=60.0)
        return node.communicate("\n", timeout=20.0)[0].strip()


def test_nothing_of_another_host_arrives_with_default_settings(
    hosts: TwoHosts, ros_domain: RosDomain
) -> None:
    assert received_from_the_other_host(hosts, ros_domain) == ""


def test_every_host_of_the_network_is_received_with_subnet(hosts: TwoHosts, ros_domain: RosDomain) -> None:
    """The attack works: the tests beside this one can fail."""
    open_to_all = {DISCOVERY_RANGE: "SUBNET"}
    assert received_from_the_other_host(hosts, ros_domain, **open_to_all) == ALL


def test_a_container_of_another_user_on_the_own_host_is_received_without_opening_the_network(
    hosts: TwoHosts, ros_domain: RosDomain
) -> None:
    """The two share no memory."""
    env = environment(ros_domain)
    logs = {"ROS_LOG_DIR": "/tmp", "HOME": "/tmp"}
    command = in_container(hosts.robot, attack(OURS), other_user=True)
    assert received(hosts, command, env | logs, env) == ALL


@pytest.mark.slow
@pytest.mark.parametrize(("peer", "arrives"), [(STRANGER, ALL), ("10.77.0.9", "")])
def test_with_a_static_peer_that_host_is_received_and_no_other(
    hosts: TwoHosts, ros_domain: RosDomain, peer: str, arrives: str
) -> None:
    assert received_from_the_other_host(hosts, ros_domain, **{STATIC_PEERS: peer}) == arrives


@pytest.mark.parametrize(
    "code", [VICTIM, pytest.param(NOT_OURS, marks=pytest.mark.slow)], ids=["ours", "other"]
)
def test_the_sockets_of_a_node_are_bound_to_loopback_with_default_settings(
    hosts: TwoHosts, ros_domain: RosDomain, code: str
) -> None:
    """Also those of a node that is not of Fulmar, as a launcher of Fulmar starts it."""
    given = environment(ros_domain)
    env = given if code == VICTIM else given | environment_of_any_node(given)
    with victim(hosts, env, code) as node, inside(hosts.robot):
        own = [connection.laddr.ip for connection in psutil.Process(node.pid).net_connections("udp4")]
    assert set(own) == {"127.0.0.1"}
