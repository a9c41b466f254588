"""The parts of a family that can stick, one by one: valves, surfaces, motors, wheels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Fixture:
    """A part on the body, as people see it."""

    name: str
    position: tuple[float, float, float]  # in the body's frame [m]
    axis: tuple[float, float, float] | None = None  # along which its x axis points; None: as the body's
    wheel: tuple[
        float, ...
    ] = ()  # radius and width, the axle along y; of a ball the radius; none: a nozzle [m]


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
