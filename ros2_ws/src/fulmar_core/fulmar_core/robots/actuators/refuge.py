"""What the last node before the hardware applies when commands end: the safe controller of a family.

Pure functions of time; who decides that commands have ended is in `fulmar_core.safety`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Protocol

import numpy as np

from fulmar_core.states.state import RigidBodyState

DOWN = "is down"  # what a safe controller that steers has done in the end
LANDS_S = 300.0  # longest time for it to bring a craft down, which at 0.4 m/s is from 100 m [s]
LONGEST_S = 60.0  # after which no slowdown goes on: a refuge that steers a vehicle has no end of its own [s]


class Refuge(Protocol):
    """Safe controller of one family of actuators.

    Attributes:
        longest_s: Time after which its command is the safe one, whatever came before; infinite where it goes on
            controlling [s].
        doing: What it does, in words; empty where it does not steer.
        stuck: Name of an actuator that stands, and where, for one that steers; None while none is known to.
    """

    longest_s: float
    doing: str
    stuck: tuple[str, float] | None

    def command(self, since_s: float, last: np.ndarray, state: RigidBodyState | None) -> np.ndarray:
        """Command to apply.

        Args:
            since_s: Time since commands ended, >= 0 [s].
            last: Last command that was applied before that, shape (n,).
            state: Newest measured state; None where nothing measures one. A family that cannot simply stop, such as a
                wing, steers by it, and needs an answer without it too.

        Returns:
            Shape (n,), within the actuators' limits.
        """
        ...


class StopAtOnce:
    """Closed valves, propellers and fans that stop: the safe command from the first moment on."""

    longest_s = 0.0
    doing = ""
    stuck: tuple[str, float] | None = None

    def __init__(self, safe: np.ndarray) -> None:
        self._safe = safe

    def command(self, since_s: float, last: np.ndarray, state: RigidBodyState | None) -> np.ndarray:
        """See `Refuge.command`."""
        return self._safe.copy()


class RampDown:
    """Wheels that slow down as fast as they may, so that they do not lock."""

    doing = ""
    stuck: tuple[str, float] | None = None

    def __init__(self, scale: np.ndarray, slew: Sequence[float]) -> None:
        """Prepare.

        Args:
            scale: Largest command of each actuator, shape (n,).
            slew: Fastest change of each, > 0 [per s].
        """
        self._slew = np.asarray(slew)
        self.longest_s = max(float(most / rate) for most, rate in zip(scale, slew, strict=True))

    def command(self, since_s: float, last: np.ndarray, state: RigidBodyState | None) -> np.ndarray:
        """See `Refuge.command`."""
        left = np.maximum(np.abs(last) - since_s * self._slew, 0.0)
        return np.where(left > 0.0, np.copysign(left, last), 0.0)


def slowdown(refuge: Refuge, last: np.ndarray, safe: np.ndarray, period_s: float) -> Iterator[np.ndarray]:
    """Commands of a refuge until it comes to the safe one, a period apart; none where actuators stop at once.

    Args:
        refuge: Of a family that comes to rest within `LONGEST_S`.
        last: Command before, shape (n,).
        safe: Safe command, shape (n,).
        period_s: Time between two commands, > 0 [s].

    Yields:
        Shape (n,), never the safe command itself.
    """
    for step in range(1, 1 + int(min(refuge.longest_s, LONGEST_S) / period_s)):
        command = refuge.command(step * period_s, last, None)
        if not np.any(command != safe):
            return
        yield command
