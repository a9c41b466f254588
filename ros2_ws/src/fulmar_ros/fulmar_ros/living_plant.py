"""Another plant that lives in the ROS domain under the same name: found, named and refused before ours begins."""

from __future__ import annotations

import contextlib
import os
import socket
import time
from collections.abc import Callable, Iterator

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from fulmar_core.errors import ConfigError
from fulmar_core.topics import ACTUATORS_STATE, DIAGNOSTICS
from fulmar_ros.command_writers import full_name
from fulmar_ros.qos import subscriber_qos

PLANT = "plant"  # name of the node
DISCOVERY_S = (
    0.5  # from the creation of a node until it knows the others on a computer that is not overloaded
)
LATE_S = 5.0  # the same on one that is
WORDS_S = 3.0  # a plant publishes diagnostics once a second
LOOK_S = 0.05


def refuse_living_plant(node: Node, namespace: str, *, since_s: float, spins: bool) -> None:
    """Refuse to start a plant under a namespace where another one lives.

    Returns at once where the node is old enough and nothing is found. A plant that dies while it is asked who it is
    does not count. A node that is created after a plant was killed never discovers that one.

    Args:
        node: Looks at the graph; where it is a plant itself, it does not count.
        namespace: Of the plant, absolute.
        since_s: When the node was created, on the monotonic clock [s].
        spins: Whether another thread serves the node's callbacks.

    Raises:
        ConfigError: Another plant lives there; with its name, process and host.
    """
    if not sees_living_plant(node, namespace, since_s=since_s):
        return
    where = _where(node, namespace, spins=spins)
    if where:
        domain = os.environ.get("ROS_DOMAIN_ID", "") or "0"
        raise ConfigError(
            f"a plant of the name {namespace}/{PLANT} lives in ROS domain {domain} already: {where}. Two would drive "
            "one robot, or be driven by one controller. Stop that one, or set ROS_DOMAIN_ID to another number."
        )


def sees_living_plant(node: Node, namespace: str, *, since_s: float) -> bool:
    """Whether another plant is discovered under a namespace; arguments as of `refuse_living_plant`."""
    while not living_plants(node, namespace):
        if time.monotonic() > since_s + DISCOVERY_S:
            return False
        time.sleep(LOOK_S)
    return True


def living_plants(node: Node, namespace: str) -> list[str]:
    """Full names of other nodes that publish what actuators do, as far as they are discovered.

    Two plants that start at once publish nothing yet: beside a plant every node of its name counts.
    """
    own = node.get_fully_qualified_name()
    names = [
        full_name(info) for info in node.get_publishers_info_by_topic(f"{namespace}/{ACTUATORS_STATE.name}")
    ]
    if own in names:
        names.remove(own)
    if own == f"{namespace}/{PLANT}":
        same = [found for found in node.get_node_names_and_namespaces() if found == (PLANT, namespace)]
        names += [own] * (len(same) - 1)
    return names


def _where(node: Node, namespace: str, *, spins: bool) -> str:
    """Name, process and host of the plant that is seen; empty where it is gone before it has said them."""
    words: list[str] = []
    ours = (str(os.getpid()), socket.gethostname())

    def read(message: DiagnosticArray) -> None:
        for status in message.status:
            values = {pair.key: pair.value for pair in status.values}
            place = values.get("pid", ""), values.get("host", "")
            if place != ours and values.get("node", "") == f"{namespace}/{PLANT}":
                words.append(f"{values['node']}, process {place[0]} on host {place[1]}")

    subscription = node.create_subscription(
        DiagnosticArray, DIAGNOSTICS.name, read, subscriber_qos(DIAGNOSTICS, reliable=True, depth=10)
    )
    try:
        with _serving(node, spins=spins) as pause:
            until_s = time.monotonic() + WORDS_S
            while (names := living_plants(node, namespace)) and not words:
                if time.monotonic() > until_s:
                    return f"{names[0]}, which has not said its process and host within {WORDS_S:g} s"
                pause()
        return words[0] if words else ""
    finally:
        node.destroy_subscription(subscription)


@contextlib.contextmanager
def _serving(node: Node, *, spins: bool) -> Iterator[Callable[[], None]]:
    """A function that lets time pass while the callbacks of a node are served."""
    if spins:
        yield lambda: time.sleep(LOOK_S)
        return
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    try:
        yield lambda: executor.spin_once(LOOK_S)
    finally:
        executor.remove_node(node)
        executor.shutdown()
