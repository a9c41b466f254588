"""The seam between an emulated device and the physics behind it."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from fulmar_core.backend import Sample


class EmulatedDevice(Protocol):
    """A device at the other end of a driver's wire.

    Attributes:
        address: Where the driver finds it.
    """

    address: str

    def command(self, now_s: float) -> np.ndarray:
        """Read what has come, and say what the device now does by itself, its own timeout included.

        Args:
            now_s: Monotonic clock [s].

        Returns:
            In the units of the robot's commands, shape (n,).
        """
        ...

    def report(self, sample: Sample, now_s: float) -> None:
        """Send what the device measures, as often as it does."""
        ...

    def close(self) -> None:
        """Take the wire away."""
        ...
