"""Measurements that are wrong or missing while the robot moves."""

from __future__ import annotations

import copy
import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from nav_msgs.msg import Odometry

from fulmar_bags.message_reader import stamp_ns
from fulmar_core.robots.sensors.repetition import FROZEN_AFTER
from fulmar_evaluation.faults.fault import STAYS_S, Fault, Outcome, stopped
from fulmar_evaluation.faults.fault_environment import RELAYED, Injection, delayed, lost
from fulmar_evaluation.faults.live_system import LiveSystem
from fulmar_ros.convert import stamp_of

MARGIN_S = 0.5  # beyond the time in which a robot is watched
FORWARD_NS, BACKWARD_NS = 1_000_000_000_000, 2_500_000_000
BEFORE_S = 3.0  # simulated clocks begin near zero; a jump back must not end before that
EPOCH_S = 6.0  # in which it is seen whether a robot goes on
BACK_NS = 1_000_000  # so little, with each message, that it is no jump of time


def intercept(live: LiveSystem, change: Injection, detection_s: float) -> Outcome:
    """Change every message from now on; the controller commands what is safe with its next beat.

    Args:
        live: The system.
        change: What is done to each message.
        detection_s: The longest time until the controller notices [s].
    """
    since_s = live.until_it_moves()
    live.injector.change = change
    return stopped(live, since_s, detection_s + live.corrected_s)


def changing(change: Callable[[Any], None]) -> Injection:
    """Pass every message on after a change in place."""

    def changed(message: Any) -> Any:
        change(message)
        return message

    return changed


def frozen() -> Injection:
    """The first message again and again, each with its own stamp."""
    kept: list[Any] = []

    def change(message: Any) -> Any:
        kept.append(kept[0] if kept else copy.deepcopy(message))
        again = copy.deepcopy(kept[0])
        again.header.stamp = message.header.stamp
        return again

    return change


def odometry_silent(live: LiveSystem) -> Outcome:
    """Nothing comes any more."""
    return intercept(live, lost, live.watchdog_s)


def odometry_frozen(live: LiveSystem) -> Outcome:
    """The same measurement with new stamps."""
    return intercept(live, frozen(), (FROZEN_AFTER + 1) * live.tick_s)


def odometry_not_a_number(live: LiveSystem) -> Outcome:
    """A velocity is NaN."""

    def change(message: Odometry) -> None:
        message.twist.twist.linear.x = math.nan

    return intercept(live, changing(change), live.tick_s)


def odometry_in_a_wrong_frame(live: LiveSystem) -> Outcome:
    """The frame is another one."""

    def change(message: Odometry) -> None:
        message.header.frame_id = "map"

    return intercept(live, changing(change), live.tick_s)


def odometry_with_a_wrong_quaternion(live: LiveSystem) -> Outcome:
    """The quaternion has twice the unit length."""

    def change(message: Odometry) -> None:
        attitude = message.pose.pose.orientation
        for part in "xyzw":
            setattr(attitude, part, 2.0 * getattr(attitude, part))

    return intercept(live, changing(change), live.tick_s)


def odometry_out_of_order(live: LiveSystem) -> Outcome:
    """Stamps go back from message to message."""
    first: list[int] = []

    def change(message: Odometry) -> None:
        first.append(stamp_ns(message.header.stamp))
        message.header.stamp = stamp_of(first[0] - BACK_NS * len(first))

    return intercept(live, changing(change), live.tick_s)


def odometry_late(live: LiveSystem) -> Outcome:
    """Everything comes later by the same time, which is longer than the robot may be blind.

    The result is taken before that time is over.
    """
    limit_s = live.watchdog_s + live.corrected_s
    late_s = limit_s + STAYS_S + MARGIN_S
    return intercept(live, delayed(late_s), live.watchdog_s)


def odometry_dated_back(live: LiveSystem) -> Outcome:
    """Its stamps jump back, and no clock did: for the plant, answers to them come far too late."""
    since_s = _until_mid_way(live)
    live.injector.change = _stamped(-BACKWARD_NS)
    # What was measured just before is answered with the next beat, and that answer counts.
    outcome = stopped(live, since_s, live.silenced_s + live.beat_s)
    epoch, _ = _epoch(live, since_s)
    return replace(outcome, passed=outcome.passed and epoch not in ("", "0"))


def time_jump_forwards(live: LiveSystem) -> Outcome:
    """The clock of the plant is set, by which it stamps what it measures and reads what it is answered."""
    return _jump(live, FORWARD_NS)


def time_jump_backwards(live: LiveSystem) -> Outcome:
    """The same, back."""
    return _jump(live, -BACKWARD_NS)


def _jump(live: LiveSystem, by_ns: int) -> Outcome:
    """A new epoch begins, in words, and the robot goes on in it."""
    since_s = _until_mid_way(live)
    live.injector.change, live.answers.change = _stamped(by_ns), _stamped(-by_ns)
    time.sleep(EPOCH_S)
    epoch, mode = _epoch(live, since_s)
    reported = epoch not in ("", "0")
    goes_on = mode == "active" and any(
        moved for _, moved in live.observer.applied_since(since_s + EPOCH_S / 2.0)
    )
    reaction = f"epoch {epoch} begins; {'goes on' if goes_on else mode}"
    return Outcome("controller" if reported else "", reaction, reported and goes_on)


def _until_mid_way(live: LiveSystem) -> float:
    """Let it go far enough for a jump back to end after the beginning of time, and say when that is [s]."""
    live.until_it_moves()
    time.sleep(BEFORE_S)
    return time.monotonic()


def _stamped(by_ns: int) -> Injection:
    def change(message: Any) -> None:
        message.header.stamp = stamp_of(stamp_ns(message.header.stamp) + by_ns)

    return changing(change)


def _epoch(live: LiveSystem, since_s: float) -> tuple[str, str]:
    """The epoch that the controller has reported since then, and what it was doing in it."""
    statuses = [
        status
        for status in live.observer.statuses_since(since_s)
        if status.who == "controller" and "epoch" in status.values
    ]
    return (statuses[-1].values["epoch"], statuses[-1].values["mode"]) if statuses else ("", "silent")


INPUT_FAULTS = (
    *(
        Fault(do, RELAYED)
        for do in (
            odometry_silent,
            odometry_late,
            odometry_frozen,
            odometry_not_a_number,
            odometry_in_a_wrong_frame,
            odometry_with_a_wrong_quaternion,
            odometry_out_of_order,
            odometry_dated_back,
        )
    ),
    Fault(time_jump_forwards, replace(RELAYED, answers_pass=True)),
    Fault(time_jump_backwards, replace(RELAYED, answers_pass=True)),
)
