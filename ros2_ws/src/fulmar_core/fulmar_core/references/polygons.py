"""Paths of straight lines: square, two squares as a figure of eight, regular polygon."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from fulmar_core.references.spacing import Point, along_corners, few, on_circle, positive


@dataclass(frozen=True)
class Square:
    """Counter-clockwise from its lower left corner."""

    kind: Literal["square"]
    side: float  # [m]
    centre: Point = (0.0, 0.0)

    closed: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Refuse a point."""
        positive(side=self.side)

    def points(self, count: int) -> np.ndarray:
        """Equally spaced points, shape (count, 2) [m]; see `along_corners`."""
        corners = 0.5 * self.side * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
        return along_corners(corners, count, closed=True, centre=self.centre)


@dataclass(frozen=True)
class InfiniteSquare:
    """Two squares that share a corner at the centre, driven as a figure of eight.

    One lies to the upper right and is driven counter-clockwise, the other to the lower left and clockwise, so the
    path goes straight on through the centre.
    """

    kind: Literal["infinite_square"]
    side: float  # of each square [m]
    centre: Point = (0.0, 0.0)

    closed: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Refuse a point."""
        positive(side=self.side)

    def points(self, count: int) -> np.ndarray:
        """Equally spaced points, shape (count, 2) [m]; see `along_corners`."""
        right = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
        left = [[0.0, 0.0], [0.0, -1.0], [-1.0, -1.0], [-1.0, 0.0]]
        return along_corners(self.side * np.array(right + left), count, closed=True, centre=self.centre)


@dataclass(frozen=True)
class Ngon:
    """Regular polygon, counter-clockwise from a corner due east."""

    kind: Literal["ngon"]
    corners: int
    radius: float  # of the circle through the corners [m]
    centre: Point = (0.0, 0.0)

    closed: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Refuse what is no polygon."""
        positive(radius=self.radius)
        if self.corners < 3:
            raise ValueError("'corners' must be 3 or more.")
        few(corners=self.corners)

    def points(self, count: int) -> np.ndarray:
        """Equally spaced points, shape (count, 2) [m]; see `along_corners`."""
        corners = self.radius * on_circle(np.arange(self.corners) / self.corners)
        return along_corners(corners, count, closed=True, centre=self.centre)
