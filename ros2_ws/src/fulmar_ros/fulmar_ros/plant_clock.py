"""Clock of a plant, simulated or real, and other publishers of `/clock` in its ROS domain."""

from __future__ import annotations

import time
from dataclasses import dataclass

from rclpy.node import Node

from fulmar_core.robots.topics import CLOCK, SIMULATION_START_NS
from fulmar_ros.graph import full_name
from fulmar_ros.living_plant import LOOK_S


@dataclass
class SimulatedTime:
    """A clock that only moves on, also across episodes."""

    now_ns: int = SIMULATION_START_NS

    @property
    def steady_ns(self) -> int:
        """The same: nothing sets it back [ns]."""
        return self.now_ns

    def advance(self, seconds: float) -> None:
        """Move on [s]."""
        self.now_ns += round(seconds * 1e9)


class WallTime:
    """The clock of the machine: it moves by itself, and all machines of a robot are to agree on it (PTP, chrony)."""

    @property
    def now_ns(self) -> int:
        """Since the epoch [ns]."""
        return time.time_ns()

    @property
    def steady_ns(self) -> int:
        """Since some moment, whatever NTP or PTP do to the clock [ns]."""
        return time.monotonic_ns()

    def advance(self, seconds: float) -> None:
        """Nothing to do: real time passes anyway [s]."""


def other_clocks(node: Node, *, since_s: float, within_s: float) -> list[str]:
    """Full names of other nodes that publish the clock, as soon as one is discovered.

    Two simulations in one domain share one clock. A node created at `since_s` (monotonic [s]) looks for `within_s` [s].
    """
    own = node.get_fully_qualified_name()
    while True:
        found = {full_name(info) for info in node.get_publishers_info_by_topic(CLOCK.name)} - {own}
        if found or time.monotonic() > since_s + within_s:
            return sorted(found)
        time.sleep(LOOK_S)
