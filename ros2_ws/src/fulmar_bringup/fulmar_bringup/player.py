"""Plays a bag into ROS: the recorded bytes, in the order and at the pace of the run."""

from __future__ import annotations

import bisect
import importlib
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock

from fulmar_bags.contents import Bag
from fulmar_bags.decode import stamps_ns
from fulmar_bags.gathered import Topic
from fulmar_core.config.errors import BagError, ConfigError, UnknownNameError
from fulmar_core.robots.topics import CLOCK, ODOMETRY, WIRES
from fulmar_ros.convert import stamp_of
from fulmar_ros.qos import publisher_qos
from fulmar_ros.runtime import ros_node

NS = 1_000_000_000
CLOCK_HZ = 100.0  # of what we publish: rclpy suffers from a faster one
DEPTH = 50
GOODBYE_S = 0.3  # for the last messages to arrive


@dataclass(frozen=True)
class Schedule:
    """Messages and when to publish them."""

    times_ns: list[int]  # on the timeline of the run, rising
    topics: list[str]  # of each message
    data: list[bytes]
    begin_ns: int  # of the timeline
    end_ns: int

    def __len__(self) -> int:
        """Number of messages."""
        return len(self.times_ns)


def schedule(bag: Bag, *, topics: Sequence[str] | None = None, start_s: float = 0.0) -> Schedule:
    """Times of the messages of a bag.

    The timeline is that of the stamps in the odometry where there are any, so that a lock-step run, which was recorded
    as fast as the machine went, plays at its own pace; else the time of recording.

    Args:
        bag: The bag.
        topics: Names, relative to the robot's namespace or absolute; all but the clock by default.
        start_s: Leave out so much of the beginning [s].

    Raises:
        BagError: There is nothing to play.
        ConfigError: Unknown topic, or a start beyond the end.
    """
    chosen = _chosen(bag, topics)
    to_run_time = _timeline(bag)
    every = sorted(
        (to_run_time(log), log, topic.name, index)
        for topic in chosen
        for index, log in enumerate(topic.log_ns)
    )
    if not every:
        raise BagError(f"{bag.path}: holds no message to play.")
    first, last = every[0][0], every[-1][0]
    begin = first + round(start_s * NS)
    if begin > last:
        raise ConfigError(f"--start {start_s:g}: the bag is {(last - first) / NS:.2f} s long. Begin earlier.")
    latched = {wire.name for wire in WIRES if wire.delivery == "latched"}
    kept = [
        (max(time_ns, begin), name, index)
        for time_ns, _, name, index in every
        # Latched messages from before the start are published at the start.
        if time_ns >= begin or bag.relative(name) in latched
    ]
    by_name = {topic.name: topic for topic in chosen}
    return Schedule(
        [time_ns for time_ns, _, _ in kept],
        [name for _, name, _ in kept],
        [by_name[name].data[index] for _, name, index in kept],
        begin,
        last,
    )


def _chosen(bag: Bag, topics: Sequence[str] | None) -> list[Topic]:
    full = {name: topic for name, topic in bag.topics.items() if len(topic)}
    if not topics:
        return [topic for name, topic in full.items() if name != CLOCK.name]
    found = []
    for name in topics:
        absolute = name if name in full else f"{bag.prefix}{name}"
        if absolute not in full:
            raise UnknownNameError("topic", name, [bag.relative(each) for each in full])
        found.append(full[absolute])
    return found


def _timeline(bag: Bag) -> Any:
    """From time of recording to the time of the run [ns]."""
    topic = bag.of(ODOMETRY)
    stamps = stamps_ns(topic) if len(topic) > 1 else None
    if stamps is None or (np.diff(stamps) < 0).any():
        return int
    new = np.concatenate(([True], np.diff(stamps) > 0))  # a repeated measurement marks no time
    stamps = stamps[new]
    if len(stamps) < 2:
        return int
    logs = [log for log, kept in zip(topic.log_ns, new, strict=True) if kept]

    def run_time(log_ns: int) -> int:
        """In whole numbers, since a float cannot hold nanoseconds since the epoch.

        The run is as long as its odometry; messages from before, while nodes started, are published at its beginning.
        """
        after = bisect.bisect_left(logs, log_ns)
        if after == 0:
            return int(stamps[0])
        if after == len(logs):
            return int(stamps[-1])
        low, high = logs[after - 1], logs[after]
        share = (log_ns - low) / (high - low) if high > low else 1.0
        return int(stamps[after - 1]) + round(share * int(stamps[after] - stamps[after - 1]))

    return run_time


@dataclass(frozen=True)
class Played:
    """Result of playing."""

    messages: int
    rounds: int
    left_out: tuple[str, ...]  # topics whose type is not installed
    late_ms_p99: float  # behind the schedule [ms]


def play(
    plan: Schedule,
    bag: Bag,
    *,
    rate: float = 1.0,
    loop: bool = False,
    clock: bool = False,
    wait_s: float = 0.5,
    stop: threading.Event | None = None,
) -> Played:
    """Publish a schedule of a bag.

    Args:
        plan: From `schedule`.
        bag: Has the types.
        rate: Seconds of the run in a wall-clock second, > 0.
        loop: Begin again at the end, until stopped. Time then jumps back, which begins a new epoch in a controller.
        clock: Publish `/clock`, the time of the run.
        wait_s: Before the first message, for subscribers to find us [s].
        stop: Ends it early.

    Raises:
        BagError: No type of any topic is installed.
    """
    stop = stop or threading.Event()
    with ros_node("bag_player", lambda _error: stop.set()) as node:
        publishers, left_out = _publishers(node, plan, bag)
        player = _Player(plan, publishers, node if clock else None, rate, stop)
        stop.wait(wait_s)
        rounds = 0
        while not stop.is_set():
            player.play_once()
            rounds += 1
            if not loop:
                break
        time.sleep(GOODBYE_S)
        late = player.late_ms
        return Played(player.count, rounds, left_out, float(np.percentile(late, 99)) if late else 0.0)


def _publishers(node: Node, plan: Schedule, bag: Bag) -> tuple[dict[str, Any], tuple[str, ...]]:
    wires = {wire.name: wire for wire in WIRES}
    publishers, left_out = {}, []
    for name in sorted(set(plan.topics)):
        topic = bag.topics[name]
        package, _, kind = topic.type.partition("/msg/")
        try:
            message = getattr(importlib.import_module(f"{package}.msg"), kind)
        except (ImportError, AttributeError, ValueError):
            left_out.append(f"{name} ({topic.type})")
            continue
        wire = wires.get(bag.relative(name))
        qos = publisher_qos(wire) if wire is not None and wire.type == topic.type else QoSProfile(depth=DEPTH)
        publishers[name] = node.create_publisher(message, name, qos)
    if not publishers:
        raise BagError(f"{bag.path}: the type of no topic is installed: {', '.join(left_out)}.")
    return publishers, tuple(left_out)


class _Player:
    """Goes through the schedule by absolute deadlines on a steady clock."""

    def __init__(
        self,
        plan: Schedule,
        publishers: dict[str, Any],
        clock: Node | None,
        rate: float,
        stop: threading.Event,
    ) -> None:
        self._plan, self._publishers, self._rate, self._stop = plan, publishers, rate, stop
        self._clock = clock.create_publisher(Clock, CLOCK.name, publisher_qos(CLOCK)) if clock else None
        self._clock_due_ns = 0
        self.count = 0
        self.late_ms: list[float] = []

    def play_once(self) -> None:
        plan, began = self._plan, time.monotonic_ns()
        self._clock_due_ns = plan.begin_ns
        for time_ns, name, data in zip(plan.times_ns, plan.topics, plan.data, strict=True):
            while self._clock is not None and self._clock_due_ns <= time_ns:
                if not self._wait_for(self._clock_due_ns, began):
                    return
                self._clock.publish(Clock(clock=stamp_of(self._clock_due_ns)))
                self._clock_due_ns += round(NS * self._rate / CLOCK_HZ)
            if not self._wait_for(time_ns, began):
                return
            publisher = self._publishers.get(name)
            if publisher is not None:
                publisher.publish(data)
                self.count += 1

    def _wait_for(self, time_ns: int, began_ns: int) -> bool:
        """Wait until a time of the run; False if stopped meanwhile."""
        due = began_ns + round((time_ns - self._plan.begin_ns) / self._rate)
        ahead_s = (due - time.monotonic_ns()) / 1e9
        if ahead_s > 0.0 and self._stop.wait(ahead_s):
            return False
        self.late_ms.append(max(0.0, (time.monotonic_ns() - due) / 1e6))
        return not self._stop.is_set()
