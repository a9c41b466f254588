"""Whether a robot that something was done to is safe: it stops or goes on, and somebody said why."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable

from nav_msgs.msg import Odometry

from fulmar_core.robots.topics import TRUTH
from fulmar_core.robots.wire_check import BETWEEN, WARNINGS
from fulmar_evaluation.faults.by_kind import FAULTS
from fulmar_evaluation.faults.fault import STAYS_S, Outcome
from fulmar_evaluation.faults.fault_environment import goal_of
from fulmar_evaluation.faults.live_system import LiveSystem
from fulmar_evaluation.faults.observer import HealthStatus, wait_for
from fulmar_ros.convert import OdometryReader
from fulmar_ros.qos import subscriber_qos

LEVEL_AGAIN_S = 10.0  # for an aircraft to fly level again, or to come down
AFTER_S = 4.0  # for which it is watched once it was said


class DistanceWatch:
    """Records the true distance from the goal: a place [m], or of what only turns an angle [deg]."""

    def __init__(self, live: LiveSystem) -> None:
        """Subscribe to the truth."""
        self._read, self._lock = OdometryReader(live.plan.frames), threading.Lock()
        self._distance, self._axes = FAULTS[live.robot.kind.name].distance, live.robot.state_type.AXES
        self._goal = live.robot.state_type.target_at(goal_of(live.robot)).tolist()
        self._newest = math.inf
        live.bystander.create_subscription(
            Odometry, TRUTH.name, self._on_truth, subscriber_qos(TRUTH), raw=True
        )

    def _on_truth(self, data: bytes) -> None:
        read = self._read.read(data)
        if read is None:
            return
        distance = self._distance.of(read.state, self._goal, self._axes)
        with self._lock:
            self._newest = distance

    @property
    def newest(self) -> float:
        """The newest distance; infinite before the first."""
        with self._lock:
            return self._newest

    @property
    def near(self) -> float:
        """Within which the robot is at its goal."""
        return self._distance.near

    @property
    def astray(self) -> float:
        """By which it may be farther away after a while."""
        return self._distance.astray


def complaint(live: LiveSystem, since_s: float, wanted: Callable[[str], bool]) -> HealthStatus | None:
    """The first status since a time with a problem or a warning that is wanted, and that no status before had."""
    every = live.observer.statuses_since(0.0)
    before = {words for each in every if each.received_s < since_s for words in words_of(each)}
    for status in every:
        if status.received_s >= since_s:
            new = [words for words in words_of(status) if words not in before and wanted(words)]
            if new:
                return HealthStatus(status.received_s, status.who, status.level, new[0], status.values)
    return None


def words_of(status: HealthStatus) -> list[str]:
    """Its problem and its warnings; none of a node without either."""
    warnings = [words for words in status.values.get(WARNINGS, "").split(BETWEEN) if words]
    return [*([status.text] if status.level != "ok" else []), *warnings]


def endured(
    live: LiveSystem,
    since_s: float,
    limit_s: float,
    distance: DistanceWatch | None = None,
    wanted: Callable[[str], bool] = bool,
    *,
    drifts: bool = False,
) -> Outcome:
    """Whether it was said in time, and the robot then stops, copes, or reaches its goal.

    Args:
        live: The system.
        since_s: When it was done, on the monotonic clock [s].
        limit_s: The longest time until somebody says it, or the robot is at its goal [s].
        distance: From the goal; None: of an aircraft, which has to fly level, or in a refuge of its plant.
        wanted: Whether words are those that have to be said.
        drifts: Nothing is left that could stop a robot that floats, so that it may go astray.
    """
    at_goal = [False]

    def over() -> bool:
        at_goal[0] = distance is not None and distance.newest < distance.near
        return at_goal[0] or complaint(live, since_s, wanted) is not None

    wait_for(over, since_s + limit_s - time.monotonic())
    status = complaint(live, since_s, wanted)
    if status is None:
        words = f"at its goal within {time.monotonic() - since_s:.1f} s, and nobody said anything"
        return Outcome("", words if at_goal[0] else "nobody said anything", at_goal[0], None, limit_s)
    said_s, before = status.received_s - since_s, math.inf if distance is None else distance.newest
    time.sleep(AFTER_S if distance is not None else LEVEL_AGAIN_S)
    if distance is None:
        assert live.flight is not None
        flown, level = live.flight.settled(status.received_s)
        return Outcome(status.who, f"{status.text}; {flown}", level, None, limit_s)
    safe, safe_s = resting(live, since_s)
    if safe or live.has_ended:
        return Outcome(
            status.who, f"{status.text}; stopped", True, safe_s, None if safe_s is None else limit_s + AFTER_S
        )
    astray = distance.newest - before
    copes = drifts or distance.newest < distance.near or astray < distance.astray
    goes = f"after {said_s:.1f} s; {distance.newest:.2f} from its goal, {astray:+.2f} in {AFTER_S:g} s"
    return Outcome(status.who, f"{status.text} ({goes})", copes, None, None)


def resting(live: LiveSystem, since_s: float) -> tuple[bool, float | None]:
    """Whether nothing has moved for a while, and the time to the first safe state since then [s]."""
    applied = live.observer.applied_since(since_s)
    moving = [received_s for received_s, moves in applied if moves]
    last_s = moving[-1] if moving else since_s
    safe = [received_s for received_s, moves in applied if not moves and received_s > last_s]
    rests = bool(safe) and time.monotonic() - safe[0] > STAYS_S
    return rests, safe[0] - since_s if rests else None
