"""What a robot does and what its nodes say of it, with the times at which a bystander hears it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node
from sensor_msgs.msg import JointState

from fulmar_core.robot import Robot
from fulmar_core.topics import ACTUATORS_STATE, DIAGNOSTICS, STATUS
from fulmar_ros.qos import subscriber_qos

DEPTH = 100  # messages that may wait while this process does something else


@dataclass(frozen=True)
class Word:
    """Something that a node said of itself."""

    heard_s: float  # monotonic clock [s]
    who: str  # plant, controller, estimator, estop
    level: str  # ok, warn or error
    text: str
    values: dict[str, str]


class Witness:
    """Listens, from a node that spins in a thread of its own."""

    def __init__(self, node: Node, robot: Robot) -> None:
        """Listen to what is applied, and to the health of every node."""
        self._safe = robot.actuators.safe_command
        self._lock = threading.Lock()
        self._applied: list[tuple[float, bool]] = []
        self._words: list[Word] = []
        listen = node.create_subscription
        qos = subscriber_qos(ACTUATORS_STATE, reliable=True, depth=DEPTH)
        listen(JointState, ACTUATORS_STATE.name, self._on_applied, qos)
        for wire in (DIAGNOSTICS, STATUS):
            qos = subscriber_qos(wire, reliable=True, depth=DEPTH)
            listen(DiagnosticArray, wire.name, self._on_health, qos)

    def _on_applied(self, message: JointState) -> None:
        moves = bool(np.any(np.asarray(message.effort) != self._safe))
        with self._lock:
            self._applied.append((time.monotonic(), moves))

    def _on_health(self, message: DiagnosticArray) -> None:
        levels = {DiagnosticStatus.OK: "ok", DiagnosticStatus.WARN: "warn"}
        now_s = time.monotonic()
        with self._lock:
            for status in message.status:
                values = {pair.key: pair.value for pair in status.values}
                who = status.name.partition(": ")[2]
                self._words.append(
                    Word(now_s, who, levels.get(status.level, "error"), status.message, values)
                )

    def moves(self) -> bool:
        """Whether the newest applied command is another than the safe one."""
        with self._lock:
            return bool(self._applied) and self._applied[-1][1]

    def applied_since(self, since_s: float) -> list[tuple[float, bool]]:
        """When something was applied, and whether it moved the robot."""
        with self._lock:
            return [entry for entry in self._applied if entry[0] >= since_s]

    def words_since(self, since_s: float) -> list[Word]:
        """What was said from then on."""
        with self._lock:
            return [word for word in self._words if word.heard_s >= since_s]

    def complaint_since(self, since_s: float, *, settled: frozenset[str] = frozenset()) -> Word | None:
        """The first thing that a node said which was wrong, and not wrong before."""
        for word in self.words_since(since_s):
            if word.level != "ok" and word.text not in settled:
                return word
        return None


def wait_for(condition: Callable[[], bool], timeout_s: float) -> bool:
    """Whether something happened in time."""
    end_s = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > end_s:
            return False
        time.sleep(0.005)
    return True
