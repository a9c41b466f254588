"""Detects another plant of the same name in the ROS domain, before ours begins."""

from __future__ import annotations

import contextlib
import os
import socket
import time
from collections import Counter
from collections.abc import Callable, Collection, Iterator

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.topics import ACTUATORS_STATE, DIAGNOSTICS
from fulmar_ros.graph import full_name
from fulmar_ros.operator_subscription import destroy_all, subscribe_every

PLANT = "plant"  # name of the node
# From the creation of a node until it knows the others on a computer that is not overloaded: 0.11 to 0.62 s measured.
DISCOVERY_S = 1.0
# How long a plant delays its own start for that; what it discovers later ends it, see `LATE_S`
BRIEFLY_S = 0.5
LATE_S = 5.0  # the same on a computer that is overloaded
WORDS_S = 3.0  # a plant publishes diagnostics once a second
LOOK_S = 0.05


def refuse_living_plant(
    node: Node, namespace: str, *, since_s: float, spins: bool, within_s: float = DISCOVERY_S
) -> None:
    """Refuse to start a plant under a namespace where another one lives.

    A plant that dies meanwhile does not count, and a node created after a plant was killed never discovers it.

    Args:
        node: Looks at the graph; where it is a plant itself, it does not count.
        namespace: Of the plant, absolute.
        since_s: When the node was created, on the monotonic clock [s].
        spins: Whether another thread serves the node's callbacks.
        within_s: Age of the node from which on nothing found means nothing there; an older node does not wait [s].

    Raises:
        ConfigError: Another plant lives there; with its name, process and host.
    """
    if not sees_living_plant(node, namespace, since_s=since_s, within_s=within_s):
        return
    where = _where(node, namespace, spins=spins)
    if where:
        raise ConfigError(
            f"a plant of the name {namespace.rstrip('/')}/{PLANT} lives in ROS domain {ros_domain()} already: {where}. "
            "Two would drive one robot, or be driven by one controller. Stop that one, give this robot another name, "
            "or set ROS_DOMAIN_ID to another number."
        )


def sees_living_plant(node: Node, namespace: str, *, since_s: float, within_s: float = DISCOVERY_S) -> bool:
    """Whether another plant is discovered under a namespace; arguments as in `refuse_living_plant`."""
    while not living_plants(node, namespace):
        if time.monotonic() > since_s + within_s:
            return False
        time.sleep(LOOK_S)
    return True


def living_plants(node: Node, namespace: str) -> list[str]:
    """Full names of other nodes that publish what actuators do, as far as they are discovered.

    Two plants that start at once publish nothing yet: beside a plant every node of its name counts.
    """
    own = node.get_fully_qualified_name()
    namespace = namespace.rstrip("/")  # a node without one lives under "/"
    topic = f"{namespace}/{ACTUATORS_STATE.name}"
    names = [full_name(info) for info in node.get_publishers_info_by_topic(topic)]
    if own in names:
        names.remove(own)
    if own == f"{namespace}/{PLANT}":
        same = [found for found in node.get_node_names_and_namespaces() if found == (PLANT, namespace or "/")]
        names += [own] * (len(same) - 1)
    return names


class TwinRunError(ConfigError):
    """Another run of the same name begins in the same ROS domain."""


def refuse_twins(node: Node, namespace: str, names: Collection[str]) -> None:
    """Refuse a run beside another one of its name that has begun at the same time: neither plant publishes yet.

    Args:
        node: Looks at the graph.
        namespace: Of the run, absolute.
        names: Nodes that the message may name.

    Raises:
        TwinRunError: The plant is there twice; with every node that is.
    """
    found = Counter(name for name, space in node.get_node_names_and_namespaces() if space == namespace)
    if found[PLANT] < 2:
        return
    twice = ", ".join(f"{namespace}/{name}" for name in names if found[name] > 1)
    raise TwinRunError(
        f"another run of this name goes on in ROS domain {ros_domain()}: {twice} are there twice, and two of one name "
        "would mix. Wait for it to end, give this robot another --name, or set ROS_DOMAIN_ID to another number."
    )


def ros_domain() -> str:
    """Number of the ROS domain of this process."""
    return os.environ.get("ROS_DOMAIN_ID", "") or "0"


def _where(node: Node, namespace: str, *, spins: bool) -> str:
    """Name, process and host of the plant that is seen; empty where it is gone before it has said them."""
    words: list[str] = []

    def read(message: DiagnosticArray) -> None:
        words.extend(place for _, place in others_in(message, f"{namespace.rstrip('/')}/{PLANT}"))

    subscriptions = subscribe_every(node, DiagnosticArray, DIAGNOSTICS, read)
    try:
        with _serving(node, spins=spins) as pause:
            until_s = time.monotonic() + WORDS_S
            while (names := living_plants(node, namespace)) and not words:
                if time.monotonic() > until_s:
                    return f"{names[0]}, which has not said its process and host within {WORDS_S:g} s"
                pause()
        return words[0] if words else ""
    finally:
        destroy_all(node, [subscriptions])


def others_in(message: DiagnosticArray, name: str) -> list[tuple[int, str]]:
    """Other plants of a full name in a diagnostics message: when each started [ns, wall clock], and its place."""
    ours = (str(os.getpid()), socket.gethostname())
    found = []
    for status in message.status:
        values = {pair.key: pair.value for pair in status.values}
        process, host = values.get("pid", ""), values.get("host", "")
        if (process, host) != ours and values.get("node", "") == name:
            started = values.get("started_ns", "")
            place = f"{name}, process {process} on host {host}"
            found.append((int(started) if started.isdecimal() else 0, place))
    return found


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
