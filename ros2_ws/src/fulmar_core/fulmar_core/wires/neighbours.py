"""Where the other robots of a fleet are, in a message of the wire `neighbours`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

# Names of readings of a controller.
NEIGHBOURS = (
    "neighbours"  # of `Inputs.readings`: x, y [m] and their rates [m/s] of each other robot, shape (n, 4 k)
)
DRIVEN = "neighbours_driven"  # 1 for each of them whose controller drives it, else 0, shape (n, k)


def motions_in(message: Any) -> dict[str, np.ndarray] | None:
    """Motions of a JointState, by robot: x, y [m], their rates [m/s], and 1 where it is driven, else 0, each (5,).

    Args:
        message: With `name`, `position`, `velocity` and `effort`, from ROS or from a bag; without efforts, as in bags
            of earlier versions, every robot is driven.

    Returns:
        None where it is no such message, or has numbers that are not finite.
    """
    names, count = list(message.name), len(message.name)
    if count % 2 or len(message.position) != count or len(message.velocity) != count:
        return None
    if len(message.effort) not in (0, count):
        return None
    place, velocity = np.asarray(message.position, dtype=float), np.asarray(message.velocity, dtype=float)
    driven = np.asarray(message.effort, dtype=float) if len(message.effort) else np.ones(count)
    if not (np.isfinite(place).all() and np.isfinite(velocity).all()):
        return None
    found: dict[str, np.ndarray] = {}
    for i in range(0, count, 2):
        robot, _, axis = names[i].rpartition("/")
        if axis != "x" or names[i + 1] != f"{robot}/y":
            return None
        found[robot] = np.concatenate((place[i : i + 2], velocity[i : i + 2], driven[i : i + 1]))
    return found


def readings_of(motions: Mapping[str, np.ndarray], names: Sequence[str]) -> dict[str, np.ndarray] | None:
    """The readings `NEIGHBOURS` and `DRIVEN` of some robots in this order; None where one of them is missing."""
    if any(name not in motions for name in names):
        return None
    every = np.stack([motions[name] for name in names])
    return {NEIGHBOURS: every[:, :4].reshape(1, -1), DRIVEN: every[None, :, 4]}
