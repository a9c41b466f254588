"""Reads the wires of a bag into arrays and core types, for the record of a run and for its control steps alike."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fulmar_bags.bag_reading import TWIST, types_of
from fulmar_bags.contents import Bag
from fulmar_bags.decode import (
    Odometries,
    Vectors,
    joint_vectors,
    messages,
    odometries,
    stamp_of,
    twist_vectors,
)
from fulmar_bags.gathered import Topic
from fulmar_bags.message_reader import goal_of, obstacles_of, thing_of
from fulmar_core.robots.topics import GOAL_WIRES, OBSTACLES, VELOCITY_COMMAND, Wire, goal_wires
from fulmar_core.wires.robot_name import Frames

if TYPE_CHECKING:  # the tasks take as long to import as everything else here
    from fulmar_core.tasks import Task

ABSENT = -1  # index of what is not there


@dataclass(frozen=True)
class Received:
    """One message that a controller received."""

    log_ns: int  # [ns]
    stamp_ns: int  # [ns]
    value: Any  # a Goal, discs of shape (m, 3), a pose of shape (3,), a bool or a text
    index: int = ABSENT  # of the message in its topic


class WireReader:
    """Reads wire after wire of one bag.

    Attributes:
        warnings: What cannot be read, one sentence each; begins with the warnings of the bag.
    """

    def __init__(self, bag: Bag) -> None:
        """Read from a bag."""
        self.bag, self.warnings = bag, list(bag.warnings)

    def messages(self, wire: Wire) -> list[tuple[int, Any]]:
        """Time of recording [ns] and message, of those that can be read."""
        return messages(self._topic(wire))

    def odometry(self, wire: Wire) -> Odometries:
        """Odometry of a wire."""
        return odometries(self._topic(wire))

    def vectors(self, wire: Wire, field: str = "effort") -> Vectors:
        """Vectors of a wire; `field` is that of JointState."""
        topic = self._topic(wire)
        if wire is VELOCITY_COMMAND:
            return twist_vectors(topic)
        found = joint_vectors(topic, field)
        others = found.left_out - len(topic.unreadable)
        if others:
            self.warnings.append(
                f"{others} messages of {topic.name} have other names or lengths than the first, or another type."
            )
        return found

    def with_times(self, seen: Odometries) -> Odometries:
        """Odometry with its times of recording in the place of stamps that never change."""
        if len(seen) < 2 or np.ptp(seen.stamp_ns) > 0:
            return seen
        self.warnings.append(
            "the stamps of the odometry do not advance: the times of recording stand in for them."
        )
        return replace(seen, stamp_ns=seen.log_ns)

    def unstamped_commands(self) -> Vectors | None:
        """The only `cmd_vel` without stamps that has messages; None where there is none, or several."""
        said = self.bag.reading.topics.get(VELOCITY_COMMAND.name)
        found = [
            topic
            for topic in self.bag.topics.values()
            if topic.type == TWIST
            and len(topic)
            and (topic.name == said or (not said and topic.name.split("/")[-1] == VELOCITY_COMMAND.name))
        ]
        return twist_vectors(found[0]) if len(found) == 1 else None

    def goals(self, task: Task | None) -> list[Received]:
        """Goals in the order of recording; a controller receives the topic of its task alone, None: any topic."""
        found: list[Received] = []
        for wire in (wire for topic in GOAL_WIRES for wire in goal_wires(topic)):
            count = len(self.bag.of(wire))
            if task is None or wire in goal_wires(task.goal_topic):
                found += self.received(wire, goal_of)
            elif count:
                topic = self.bag.topic_name(wire)
                self.warnings.append(
                    f"{count} messages of {topic} are left out: no goals of the task '{task.name}'."
                )
        return sorted(found, key=lambda goal: goal.log_ns)

    def obstacles(self) -> tuple[Received, ...]:
        """Obstacles as discs."""
        return self.received(OBSTACLES, obstacles_of)

    def things(self, task: Task | None) -> dict[str, tuple[Received, ...]]:
        """Poses of the things of a task, by name."""
        return {thing.name: self.received(thing.wire, thing_of) for thing in (task.things if task else ())}

    def received(
        self,
        wire: Wire,
        read: Callable[[Any, Frames], tuple[Any, str]] = lambda message, _: (message.data, ""),
    ) -> tuple[Received, ...]:
        """Messages of a wire without those that `read` finds a problem with; by default those with plain data."""
        found, problems, frames = [], Counter[str](), self.bag.frames
        for index, (log_ns, message) in enumerate(self.messages(wire)):
            value, problem = read(message, frames)
            if problem:
                problems[problem] += 1
                continue
            stamped = message.markers[:1] if wire is OBSTACLES else [message]
            stamp_ns = stamp_of(stamped[0]) if stamped and hasattr(stamped[0], "header") else 0
            found.append(Received(log_ns, stamp_ns, value, index))
        topic = self.bag.topic_name(wire)
        self.warnings += [
            f"{count} messages of {topic} are left out: {why}." for why, count in problems.items()
        ]
        return tuple(found)

    def _topic(self, wire: Wire) -> Topic:
        """The topic of a wire; messages under its name that are of another type are a warning."""
        name = self.bag.topic_name(wire)
        known = types_of(wire)
        others = sum(len(t) for t in self.bag.topics.values() if t.name == name and t.type not in known)
        if others:
            self.warnings.append(f"{others} messages of {name} have another type.")
        return self.bag.of(wire)
