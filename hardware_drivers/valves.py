"""Valves of a floating platform: their wiring orders, minimum on-time, and the message of a valve node."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

# Wiring orders by name: the thruster, counted from 0, that each entry after the bearing opens. Public sources disagree
# about the wiring of the Zero-G Lab's platform; each order belongs to its own numbering of the nozzles.
VALVE_ORDERS: dict[str, tuple[int, ...]] = {
    # snt-spacer/RoboRAN-deploy-to-robot at eeefb9a, robot_interfaces/floating_platform.py; for the nozzles of RoboRAN's
    # FloatingPlatform (pairs at 0, 90, 180 and 270°).
    "roboran": (5, 1, 3, 7, 0, 4, 6, 2),
    # elharirymatteo/RANS at 6f2720b, omniisaacgymenvs/ros/ros_node.py, on the same topic; for the nozzles of RANS
    # (pairs at 45, 135, 225 and 315°, as in configs/robots/floating_platform.yaml).
    "rans": (2, 5, 4, 7, 6, 1, 0, 3),
}


class ValveTiming:
    """Keeps a valve open until its minimum on-time is over: a solenoid that is cut short gives an unknown impulse."""

    def __init__(self, count: int, min_on_s: float) -> None:
        """Begin with closed valves.

        Args:
            count: Number of valves.
            min_on_s: Shortest opening [s].
        """
        self._min_on_ns = round(min_on_s * 1e9)
        self._opened_ns = np.full(count, -(1 << 62))
        self._open = np.zeros(count, dtype=bool)

    def allowed(self, wanted: np.ndarray, now_ns: int) -> np.ndarray:
        """Valves that may open or close now.

        Args:
            wanted: Zeros and ones, shape (n,).
            now_ns: Steady clock [ns].

        Returns:
            Zeros and ones, shape (n,). Where all are wanted closed, all close at once: that is the safe command.
        """
        want = wanted > 0.5
        if want.any():
            want = want | (self._open & (now_ns - self._opened_ns < self._min_on_ns))
        self._opened_ns = np.where(want & ~self._open, now_ns, self._opened_ns)
        self._open = want
        return want.astype(float)


def to_message(valves: np.ndarray, *, bearing: bool, order: Sequence[int]) -> list[int]:
    """The nine numbers of a valve node: the bearing, then the valves in the order of their wiring.

    Args:
        valves: Zeros and ones in the robot's order, shape (n,).
        bearing: Whether the air bearing is on.
        order: Which thruster, counted from 0, each entry after the first opens.

    Returns:
        n + 1 zeros and ones.
    """
    return [int(bearing), *(int(valves[thruster] > 0.5) for thruster in order)]


def from_message(data: Sequence[int], order: Sequence[int]) -> tuple[bool, np.ndarray] | None:
    """Parse a message for a valve node.

    Args:
        data: The message.
        order: As in `to_message`.

    Returns:
        Whether the bearing is on, and zeros and ones in the robot's order, shape (n,); None where the message has
        another length, or holds anything but zeros and ones.
    """
    if len(data) != len(order) + 1 or not set(data) <= {0, 1}:
        return None
    valves = np.zeros(len(order))
    valves[list(order)] = data[1:]
    return bool(data[0]), valves
