"""Check of `system.launch.py` before it starts a node."""

from __future__ import annotations

import os
import time
from collections.abc import Iterable

import rclpy

from fulmar_bringup.node_spec import NodeSpec
from fulmar_ros.living_plant import PLANT, refuse_living_plant
from fulmar_ros.runtime import init_ros


def refuse_living_plants(specs: Iterable[NodeSpec]) -> None:
    """Refuse to start nodes where a plant of one of their namespaces lives already; takes a second.

    The plant would refuse by itself, but by then a second controller has stopped the running robot. With security
    enabled the check is left to the plant: the launcher has no enclave.

    Raises:
        ConfigError: Another plant lives there; with its name, process and host.
    """
    namespaces = [spec.namespace for spec in specs if spec.name == PLANT]
    if not namespaces or os.environ.get("ROS_SECURITY_ENABLE", "").lower() == "true":
        return
    context = rclpy.Context()
    init_ros(context=context)
    try:
        node = rclpy.create_node(f"launch_{os.getpid()}", context=context)
        since_s = time.monotonic()
        for namespace in namespaces:
            refuse_living_plant(node, namespace, since_s=since_s, spins=False)
    finally:
        rclpy.try_shutdown(context=context)
