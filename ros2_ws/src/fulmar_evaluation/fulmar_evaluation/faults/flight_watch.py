"""How an aircraft flies after a fault: its true bank and sink."""

from __future__ import annotations

import math
import threading
import time

from nav_msgs.msg import Odometry
from rclpy.node import Node

from fulmar_core.robots.topics import TRUTH
from fulmar_core.states.attitude import euler_of
from fulmar_core.states.spatial import SpatialState
from fulmar_core.wires.robot_name import Frames
from fulmar_ros.convert import OdometryReader
from fulmar_ros.qos import subscriber_qos

MOST_BANK_DEG, MOST_SINK = 10.0, 1.0  # of a safe flight [deg], [m/s]
LEVEL_S, LEVEL_DEG, LEVEL_SINK = 0.5, 3.0, 0.3  # in level flight it stays so long within these [s, deg, m/s]
FLIES_S = 3.0  # for which it is watched
STANDS = 0.5  # a craft that is slower has come down [m/s]


class FlightWatch:
    """Records the true flight."""

    def __init__(self, node: Node, frames: Frames) -> None:
        """Subscribe to the truth."""
        self._read, self._lock = OdometryReader(frames), threading.Lock()
        # Received [s], bank [deg], sink [m/s], speed [m/s].
        self._flown: list[tuple[float, float, float, float]] = []
        node.create_subscription(Odometry, TRUTH.name, self._on_truth, subscriber_qos(TRUTH), raw=True)

    def _on_truth(self, data: bytes) -> None:
        read = self._read.read(data)
        if read is None:
            return
        state = SpatialState.from_rigid(read.state)
        bank = abs(math.degrees(float(euler_of(state.quat)[0])))
        with self._lock:
            speed = math.hypot(float(state.vx), float(state.vy), float(state.vz))
            self._flown.append((time.monotonic(), bank, -float(state.vz), speed))

    def is_level(self) -> bool:
        """Whether it has flown level for a while: a simulated craft begins with its surfaces and motors at rest."""
        with self._lock:
            newest = self._flown[-1][0] if self._flown else 0.0
            began = bool(self._flown) and self._flown[0][0] < newest - LEVEL_S
            late = [
                (bank, sink) for received_s, bank, sink, _ in self._flown if received_s >= newest - LEVEL_S
            ]
        return began and all(bank < LEVEL_DEG and abs(sink) < LEVEL_SINK for bank, sink in late)

    def is_down(self) -> bool:
        """Whether it has come down."""
        with self._lock:
            return bool(self._flown) and self._flown[-1][3] <= STANDS

    def since(self, since_s: float) -> tuple[str, bool]:
        """How it has flown since a time, in words, and whether that was safe [s]."""
        with self._lock:
            flown = [(bank, sink) for received_s, bank, sink, _ in self._flown if received_s >= since_s]
        if not flown:
            return "no true state was received after the fault", False
        bank, sink = (max(each) for each in zip(*flown, strict=True))
        safe = bank <= MOST_BANK_DEG and sink <= MOST_SINK
        return f"bank at most {bank:.1f} deg, sink at most {sink:.2f} m/s", safe

    def settled(self, since_s: float) -> tuple[str, bool]:
        """How it has flown in the last seconds, or come down, since a time; in words, and whether that was safe [s]."""
        with self._lock:
            flown = [each for each in self._flown if each[0] >= since_s]
        moving = [each for each in flown if each[3] > STANDS]
        if not moving:
            return "it stood when it was said", False
        last_s = moving[-1][0]
        bank = max(each[1] for each in moving if each[0] > last_s - FLIES_S)
        sink = max(each[2] for each in moving if each[0] > last_s - FLIES_S)
        down = flown[-1][3] <= STANDS
        words = (
            f"{'came down with' if down else 'then'} bank at most {bank:.1f} deg, sink at most {sink:.2f} m/s"
        )
        return words, bank <= MOST_BANK_DEG and sink <= MOST_SINK
