"""How wheels come to a stop: as fast as they may without locking."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fulmar_core.robot import Actuators, Rolling


def slowdown(actuators: Actuators, command: np.ndarray, period_s: float) -> Iterator[np.ndarray]:
    """Commands between one and the safe one; none where actuators stop at once, as valves and propellers do.

    Args:
        actuators: What they are, and how fast they may follow.
        command: From here, shape (n,).
        period_s: Time between commands [s].

    Yields:
        Shape (n,), never the safe command itself.
    """
    slew = actuators.response.slew
    if not slew or not isinstance(actuators, Rolling):
        return
    left = np.abs(command) - period_s * np.asarray(slew)
    while (left > 0.0).any():
        yield np.copysign(np.maximum(left, 0.0), command)
        left -= period_s * np.asarray(slew)
