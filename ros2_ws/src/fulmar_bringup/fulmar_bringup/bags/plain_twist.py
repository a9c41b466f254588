"""Velocity commands without a stamp, as most drivers of others take them: each counts from when it was recorded."""

from __future__ import annotations

import numpy as np

from fulmar_bringup.bags.contents import Bag, Topic
from fulmar_bringup.bags.decode import Vectors, messages
from fulmar_bringup.bags.told import ABSENT
from fulmar_core.topics import VELOCITY_COMMAND

TYPE = "geometry_msgs/msg/Twist"


def plain_commands(bag: Bag) -> Vectors | None:
    """The only `cmd_vel` without stamps that a bag has messages of; None where it has none, or several."""
    found = [
        topic
        for topic in bag.topics.values()
        if topic.type == TYPE and len(topic) and topic.name.split("/")[-1] == VELOCITY_COMMAND.name
    ]
    return plain_vectors(found[0]) if len(found) == 1 else None


def plain_vectors(topic: Topic) -> Vectors:
    """Twist messages as (speed ahead [m/s], turn rate [rad/s]), stamped as they were recorded."""
    found = messages(topic)
    log_ns = np.array([log for log, _ in found], dtype=np.int64)
    values = np.array([(m.linear.x, m.angular.z) for _, m in found], dtype=float).reshape(-1, 2)
    return Vectors(("speed", "yaw_rate"), log_ns, log_ns, log_ns, values, len(topic) - len(found))


def answers_within(steps_ns: np.ndarray, commands_ns: np.ndarray) -> np.ndarray:
    """Index of the first command after each step and before the next one, ABSENT where there is none, shape (n,).

    Args:
        steps_ns: When each step began, rising, shape (n,) [ns].
        commands_ns: When each command was recorded, rising [ns].
    """
    first = np.searchsorted(commands_ns, steps_ns)
    ends = np.append(steps_ns[1:], np.iinfo(np.int64).max)
    there = first < len(commands_ns)
    there[there] = commands_ns[first[there]] < ends[there]
    return np.where(there, first, ABSENT)
