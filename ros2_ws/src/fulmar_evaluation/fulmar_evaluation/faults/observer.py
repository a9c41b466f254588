"""Records of a live system: what an observer receives, and what the bag kept of it."""

from __future__ import annotations

import math
import re
import threading
import time
from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node
from sensor_msgs.msg import JointState

from fulmar_bags.contents import open_bag
from fulmar_bags.decode import stamps_ns
from fulmar_bags.message_reader import stamp_ns
from fulmar_core.config.errors import FulmarError
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.topics import ACTUATORS_STATE, DIAGNOSTICS, STATUS, Wire, command_wire
from fulmar_ros.qos import subscriber_qos

DEPTH = 100  # messages that may wait while this process does something else
NUMBER = re.compile(r"\d+(\.\d+)?")


@dataclass(frozen=True)
class HealthStatus:
    """Health that a node published."""

    received_s: float  # monotonic clock [s]
    who: str  # plant, controller, estimator, estop
    level: str  # ok, warn or error
    text: str
    values: dict[str, str]

    @property
    def problem(self) -> tuple[str, str] | None:
        """The node and its problem, without figures; None where it reports no problem."""
        return None if self.level == "ok" else (self.who, NUMBER.sub("#", self.text))


class RunObserver:
    """Records applied commands and health, in a node that spins in a thread of its own."""

    def __init__(
        self,
        node: Node,
        robot: Robot,
        wire: Wire = ACTUATORS_STATE,
        is_down: Callable[[], bool] = lambda: False,
        names: Collection[str] = (),
    ) -> None:
        """Subscribe to the applied command, and to the health of every node.

        Args:
            node: Listens.
            robot: Which.
            wire: Has the applied command.
            is_down: Whether an aircraft has come down: from then on nothing moves it.
            names: Names in the health that count, of a fleet that of the robot and of the fleet itself; empty: all.
        """
        self.wire, self._is_down, self._names = wire, is_down, tuple(names)
        self._safe = robot.actuators.safe_command
        self._lock = threading.Lock()
        # Received [s], stamp [ns], command; None of what has come down.
        self._applied: list[tuple[float, int, tuple[float, ...] | None]] = []
        # Of what cannot stop: every command of its controller; anything else is the safe controller's.
        self._commanded: set[tuple[float, ...]] | None = None if robot.kind.rests else set()
        self._statuses: list[HealthStatus] = []
        listen = node.create_subscription
        listen(JointState, wire.name, self._on_applied, subscriber_qos(wire, reliable=True, depth=DEPTH))
        if self._commanded is not None:
            command = command_wire(robot)
            qos = subscriber_qos(command, reliable=True, depth=DEPTH)
            listen(JointState, command.name, self._on_command, qos)
        for health in (DIAGNOSTICS, STATUS):
            qos = subscriber_qos(health, reliable=True, depth=DEPTH)
            listen(DiagnosticArray, health.name, self._on_health, qos)

    def _on_applied(self, message: JointState) -> None:
        applied = None if self._is_down() else tuple(float(value) for value in message.effort)
        with self._lock:
            self._applied.append((time.monotonic(), stamp_ns(message.header.stamp), applied))

    def _on_command(self, message: JointState) -> None:
        with self._lock:
            if self._commanded is not None:
                self._commanded.add(tuple(float(value) for value in message.effort))

    def _moves(self, applied: tuple[float, ...] | None) -> bool:
        """Whether a command moves the robot in a way that is not that of its safe controller."""
        if applied is None:
            return False
        if self._commanded is not None:
            return applied in self._commanded
        return bool(np.any(np.asarray(applied) != self._safe))

    def _on_health(self, message: DiagnosticArray) -> None:
        levels = {DiagnosticStatus.OK: "ok", DiagnosticStatus.WARN: "warn"}
        now_s = time.monotonic()
        with self._lock:
            for status in message.status:
                values = {pair.key: pair.value for pair in status.values}
                name, _, who = status.name.partition(": ")
                if self._names and name not in self._names:
                    continue
                self._statuses.append(
                    HealthStatus(now_s, who, levels.get(status.level, "error"), status.message, values)
                )

    def moves(self) -> bool:
        """Whether the newest applied command is another than the safe one; of what cannot stop, its controller's."""
        with self._lock:
            return bool(self._applied) and self._moves(self._applied[-1][2])

    def applied_since(self, since_s: float) -> list[tuple[float, bool]]:
        """When something was applied, and whether it moved the robot."""
        with self._lock:
            return [
                (received_s, self._moves(applied))
                for received_s, _, applied in self._applied
                if received_s >= since_s
            ]

    def received(self) -> tuple[np.ndarray, np.ndarray]:
        """When something was applied, and its stamps, shapes (n,) [s] and int64 [ns]."""
        with self._lock:
            times = np.array([received_s for received_s, _, _ in self._applied], dtype=float)
            return times, np.array([stamp for _, stamp, _ in self._applied], dtype=np.int64)

    def statuses_since(self, since_s: float) -> list[HealthStatus]:
        """Health received since a time."""
        with self._lock:
            return [status for status in self._statuses if status.received_s >= since_s]

    def problem_since(self, since_s: float) -> HealthStatus | None:
        """The first new problem since a time; see `first_problem`."""
        return first_problem(self.statuses_since(0.0), since_s)


def first_problem(statuses: list[HealthStatus], since_s: float) -> HealthStatus | None:
    """The first problem since a time, without those that stood already."""
    standing = {status.who: status.problem for status in statuses if status.received_s < since_s}.values()
    new = (status for status in statuses if status.received_s >= since_s and status.problem is not None)
    return next((status for status in new if status.problem not in standing), None)


def wait_for(condition: Callable[[], bool], timeout_s: float) -> bool:
    """Whether something happened in time."""
    end_s = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > end_s:
            return False
        time.sleep(0.005)
    return True


TORN_S = 1.0  # a recorder that dies takes no more than so much with it
IN_FLIGHT_S = 0.1  # so long before it hangs a message may be sent that it has not taken yet


@dataclass(frozen=True)
class BagEvidence:
    """The bag beside what was received."""

    lost: int  # messages that came and are not in it
    intact: bool  # it opens, and lacks nothing of the time in which its recorder could work
    words: str = ""  # what is wrong; empty if nothing is


def bag_evidence(
    record: Path,
    observer: RunObserver,
    away: tuple[float, float] | None,
    *,
    again: bool = False,
    robot: str = "",
) -> BagEvidence:
    """Compare a bag with what an observer received.

    Args:
        record: The bag, as it lies there after everybody has ended.
        observer: Received what actuators did.
        away: From when to when a fault kept the recorder from its work; for ever, where it ended it [s].
        again: Whether that recorder died, and another one goes on in its bag.
        robot: Name of the robot in the bag of a fleet; empty: the bag is of one robot.
    """
    received_s, received_ns = observer.received()
    from_s, to_s = away or (math.inf, math.inf)
    dead = away is not None and math.isinf(to_s)
    if dead:  # what comes after its end is nobody's loss
        received_s, received_ns = received_s[received_s < from_s], received_ns[received_s < from_s]
    from_s, to_s = from_s - (TORN_S if dead or again else IN_FLIGHT_S), to_s + IN_FLIGHT_S
    try:
        bag = open_bag(record).of_robot(robot) if robot else open_bag(record)
    except FulmarError as error:
        return BagEvidence(len(received_ns), False, str(error))
    found = stamps_ns(bag.of(observer.wire))
    if found is None or not len(found):
        if not len(received_ns):  # a system that ended before its plant ran has nothing to lose
            return BagEvidence(0, True)
        return BagEvidence(len(received_ns), False, f"it has nothing of {observer.wire.name}")
    # A recorder may find the plant a little later than the bystander did.
    missing = (received_ns >= found.min()) & ~np.isin(received_ns, found)
    gaps = int(np.sum(missing & ~((received_s >= from_s) & (received_s < to_s))))
    dropped = sum((bag.recording.get("dropped") or {}).values())
    problems = [
        *([f"lacks {gaps} of {observer.wire.name}"] if gaps else []),
        *([f"its recorder dropped {dropped}"] if dropped and not dead else []),
        *(() if dead or again else bag.warnings),  # of a recorder that died they say just that
    ]
    return BagEvidence(int(np.sum(missing)) + dropped, not problems, "; ".join(problems))
