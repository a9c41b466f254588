"""Where the other robots of a fleet are, as a JointState."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from sensor_msgs.msg import JointState

from fulmar_bags.message_reader import stamp_ns
from fulmar_core.safety.keep_apart import OLD_NS, Other
from fulmar_core.wires.neighbours import motions_in, readings_of
from fulmar_ros.convert import stamp_of


def neighbours_message(neighbours: Mapping[str, np.ndarray], time_ns: int) -> JointState:
    """The message of neighbours, by name: x, y [m], their rates [m/s], and whether it is driven, each (5,)."""
    message = JointState(
        name=[f"{name}/{axis}" for name in neighbours for axis in "xy"],
        position=[float(part) for motion in neighbours.values() for part in motion[:2]],
        velocity=[float(part) for motion in neighbours.values() for part in motion[2:4]],
        effort=[float(motion[4]) for motion in neighbours.values() for _ in "xy"],
    )
    message.header.stamp, message.header.frame_id = stamp_of(time_ns), "map"
    return message


class NeighbourInputs:
    """The newest motions of the robots that a guard keeps apart from its own.

    Attributes:
        stamp_ns: Of the newest message [ns].
    """

    def __init__(self, others: Sequence[Other]) -> None:
        """Know nothing of the others yet."""
        self._names = [other.name for other in others]
        self._newest: dict[str, np.ndarray] | None = None
        self.stamp_ns = -1

    def take(self, message: JointState) -> None:
        """Take a message; one without every robot that is kept apart does not count."""
        motions = motions_in(message)
        found = None if motions is None else readings_of(motions, self._names)
        if found is not None:
            self._newest, self.stamp_ns = found, stamp_ns(message.header.stamp)

    def at(self, time_ns: int) -> dict[str, np.ndarray]:
        """The readings for a control step on a measurement of a time [ns]; none where it is too old."""
        if self._newest is None or time_ns - self.stamp_ns > OLD_NS:
            return {}
        return self._newest
