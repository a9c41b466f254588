"""The nine numbers that a valve node takes: the bearing, then eight valves in the order of their wiring."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np


def to_message(valves: np.ndarray, *, bearing: bool, order: Sequence[int]) -> list[int]:
    """What the valve node is told.

    Args:
        valves: Zeros and ones in the robot's order, shape (n,).
        bearing: Whether the air bearing is on.
        order: Which thruster, counted from 0, each entry after the first opens.

    Returns:
        n + 1 zeros and ones.
    """
    return [int(bearing), *(int(valves[thruster] > 0.5) for thruster in order)]


def from_message(data: Sequence[int], order: Sequence[int]) -> tuple[bool, np.ndarray] | None:
    """What a controller that speaks to the valve node wants.

    Args:
        data: The message.
        order: As of `to_message`.

    Returns:
        Whether the bearing shall be on, and zeros and ones in the robot's order, shape (n,); None where the message has
        another length, or holds anything but zeros and ones.
    """
    if len(data) != len(order) + 1 or not set(data) <= {0, 1}:
        return None
    valves = np.zeros(len(order))
    valves[list(order)] = data[1:]
    return bool(data[0]), valves
