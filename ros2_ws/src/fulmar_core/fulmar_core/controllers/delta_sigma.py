"""Delta-sigma modulation of wrenches: what actuators did not give is asked of them in the steps after.

On/off valves give nothing of a wrench that is small beside one valve, so a law that rests on them stops short of its
goal. Carrying the rest over makes the mean right (Schreier and Temes, "Understanding Delta-Sigma Data Converters",
2005, §2, error feedback of first order; on thrusters Ciarcia, Cristi and Romano, "Experimental Demonstration of
Sigma-Delta Modulation of Spacecraft Thrusters", J. Guidance, Control, and Dynamics 36(2), 2013).
"""

from __future__ import annotations

import numpy as np

from fulmar_core.controllers.allocation import Allocation
from fulmar_core.robots.actuators.pushing import Pushing
from fulmar_core.states.rotation import Array


class DeltaSigma:
    """An allocation in space that remembers, for each robot of a batch, what it owes."""

    def __init__(self, allocation: Allocation, actuators: Pushing, *, most: np.ndarray) -> None:
        """Owe nothing.

        Args:
            allocation: From wrenches to commands.
            actuators: What carries the commands out.
            most: Carried over at most, of each number of a wrench, shape (6,) [N, N·m].
        """
        self._allocation, self._actuators, self._most = allocation, actuators, most
        self.reset()

    def reset(self) -> None:
        """Forget what is owed."""
        self.owed: np.ndarray | None = None  # shape (..., 6) [N, N·m]

    def best(self, wanted: Array, alive: Array | None = None) -> Array:
        """Commands for what is wanted and owed.

        Args:
            wanted: Wrench in the body frame, shape (..., 6) [N, N·m].
            alive: As in `Allocation.best`.

        Returns:
            Shape (..., n).
        """
        if self.owed is None or self.owed.shape != wanted.shape:
            self.owed = np.zeros(wanted.shape)
        asked = wanted + self.owed
        command = self._allocation.best(asked, alive)
        given = np.concatenate(self._actuators.wrench_in_body(command), axis=-1)
        self.owed = np.clip(asked - given, -self._most, self._most)
        return command
