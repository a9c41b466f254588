"""How actuators come to a stop: wheels as fast as they may without locking, all others at once."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fulmar_core.robot import Actuators, Rolling


def slowed(actuators: Actuators, command: np.ndarray, since_s: float) -> np.ndarray:
    """What is left of a command some time after it ended.

    Args:
        actuators: What they are, and how fast they may follow.
        command: At the end, shape (n,).
        since_s: Time since then, >= 0 [s].

    Returns:
        Shape (n,); the safe command where nothing is left.
    """
    slew = actuators.response.slew
    if not slew or not isinstance(actuators, Rolling):
        return actuators.safe_command
    left = np.maximum(np.abs(command) - since_s * np.asarray(slew), 0.0)
    return np.where(left > 0.0, np.copysign(left, command), 0.0)


def slowdown(actuators: Actuators, command: np.ndarray, period_s: float) -> Iterator[np.ndarray]:
    """Commands between one and the safe one, a period apart [s]; none where actuators stop at once.

    Yields:
        Shape (n,), never the safe command itself.
    """
    steps = 1
    while (left := slowed(actuators, command, steps * period_s)).any():
        yield left
        steps += 1
