"""The parts of a family that can stick, one by one: valves, surfaces, motors, wheels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class MovingParts:
    """Parts that commands move; there are as many of them as a command has numbers.

    Attributes:
        names: Of the parts.
        lowest: Smallest value of each, shape (n,).
        scale: Largest value of each, shape (n,).
        per_command: Values of the parts per unit of each number of a command, shape (n, n) and invertible; None: a
            command's numbers are the values of the parts.
    """

    names: tuple[str, ...]
    lowest: np.ndarray
    scale: np.ndarray
    per_command: np.ndarray | None = None
