"""Robots that run in this ROS domain, and publishers that none of their nodes receives."""

from __future__ import annotations

import time

from rclpy.node import Node

from fulmar_core.topics import JOY, WIRES, Wire
from fulmar_core.wire_check import wire_problems
from fulmar_ros.node_robot import heard_spaces
from fulmar_ros.wire_watch import offers_of

FIND_S = 1.5  # until the nodes of the domain have found this one


def running_robots(node: Node, *, find_s: float = FIND_S) -> set[str]:
    """Namespaces with a plant or a controller, after some time to find them."""
    time.sleep(find_s)
    return heard_spaces(node)


def unfit_publishers(node: Node, spaces: set[str]) -> list[str]:
    """Publishers on the wires of robots from which nothing arrives, one sentence each."""
    return [
        problem
        for space in sorted(spaces)
        for wire in WIRES
        if not wire.name.startswith("/")
        for problem in _of_wire(node, wire, f"{space.rstrip('/')}/{wire.name}")
    ]


def _of_wire(node: Node, wire: Wire, topic: str) -> list[str]:
    reliable = wire.source == "operator" and wire is not JOY
    return wire_problems(wire, topic, offers_of(node, topic), reliable=reliable)
