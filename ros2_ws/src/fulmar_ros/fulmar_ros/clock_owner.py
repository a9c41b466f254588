"""Who else publishes the clock of a ROS domain: two simulations in one domain have one clock between them."""

from __future__ import annotations

import time

from rclpy.node import Node

from fulmar_core.topics import CLOCK
from fulmar_ros.command_writers import full_name
from fulmar_ros.living_plant import LOOK_S


def other_clocks(node: Node, *, since_s: float, within_s: float) -> list[str]:
    """Full names of other nodes that publish the clock, as soon as one is discovered.

    Args:
        node: Looks at the graph.
        since_s: When the node was created, on the monotonic clock [s].
        within_s: How old the node has to be before it finds nobody [s].
    """
    own = node.get_fully_qualified_name()
    while True:
        found = {full_name(info) for info in node.get_publishers_info_by_topic(CLOCK.name)} - {own}
        if found or time.monotonic() > since_s + within_s:
            return sorted(found)
        time.sleep(LOOK_S)
