"""How an aircraft flies after a fault: its true bank and sink."""

from __future__ import annotations

import math
import threading
import time

from nav_msgs.msg import Odometry
from rclpy.node import Node

from fulmar_core.attitude import euler_of
from fulmar_core.robot_name import Frames
from fulmar_core.spatial import SpatialState
from fulmar_core.topics import TRUTH
from fulmar_ros.convert import OdometryReader
from fulmar_ros.qos import subscriber_qos

MOST_BANK_DEG, MOST_SINK = 10.0, 1.0  # of a safe flight [deg], [m/s]
LEVEL_S, LEVEL_DEG, LEVEL_SINK = 0.5, 3.0, 0.3  # in level flight it stays so long within these [s, deg, m/s]
FLIES_S = 3.0  # for which it is watched


class FlightWatch:
    """Records the true flight."""

    def __init__(self, node: Node, frames: Frames) -> None:
        """Subscribe to the truth."""
        self._read, self._lock = OdometryReader(frames), threading.Lock()
        self._flown: list[tuple[float, float, float]] = []  # received [s], bank [deg], sink [m/s]
        node.create_subscription(Odometry, TRUTH.name, self._on_truth, subscriber_qos(TRUTH), raw=True)

    def _on_truth(self, data: bytes) -> None:
        read = self._read.read(data)
        if read is None:
            return
        state = SpatialState.from_rigid(read.state)
        bank = abs(math.degrees(float(euler_of(state.quat)[0])))
        with self._lock:
            self._flown.append((time.monotonic(), bank, -float(state.vz)))

    def is_level(self) -> bool:
        """Whether it has flown level for a while: a simulated craft begins with its surfaces and motors at rest."""
        with self._lock:
            newest = self._flown[-1][0] if self._flown else 0.0
            began = bool(self._flown) and self._flown[0][0] < newest - LEVEL_S
            late = [(bank, sink) for received_s, bank, sink in self._flown if received_s >= newest - LEVEL_S]
        return began and all(bank < LEVEL_DEG and abs(sink) < LEVEL_SINK for bank, sink in late)

    def since(self, since_s: float) -> tuple[str, bool]:
        """How it has flown since a time, in words, and whether that was safe [s]."""
        with self._lock:
            flown = [(bank, sink) for received_s, bank, sink in self._flown if received_s >= since_s]
        if not flown:
            return "no true state was received after the fault", False
        bank, sink = (max(each) for each in zip(*flown, strict=True))
        safe = bank <= MOST_BANK_DEG and sink <= MOST_SINK
        return f"bank at most {bank:.1f} deg, sink at most {sink:.2f} m/s", safe
