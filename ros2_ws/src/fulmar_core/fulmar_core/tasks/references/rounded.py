"""Reference paths in the plane of straight pieces and arcs: a line, a rectangle with rounded corners, a capsule."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from fulmar_core.tasks.references.spacing import Curve, Point, on_circle, positive


@dataclass(frozen=True)
class Line(Curve):
    """Straight along x, left to right, with its middle at the centre."""

    kind: Literal["line"]
    length: float  # [m]
    centre: Point = (0.0, 0.0)

    closed: ClassVar[bool] = False

    def __post_init__(self) -> None:
        positive(length=self.length)

    def at(self, t: np.ndarray) -> np.ndarray:
        """See `Curve.at`."""
        return np.stack((self.length * (t - 0.5), 0.0 * t), axis=1)


@dataclass(frozen=True)
class Rectangle(Curve):
    """Counter-clockwise from the begin of its right edge, with corners that are quarters of circles."""

    kind: Literal["rectangle"]
    length: float  # along x [m]
    width: float  # along y [m]
    corner_radius: float  # [m]
    centre: Point = (0.0, 0.0)

    def __post_init__(self) -> None:
        positive(length=self.length, width=self.width, corner_radius=self.corner_radius)
        if 2.0 * self.corner_radius >= min(self.length, self.width):
            raise ValueError(
                f"'corner_radius' = {self.corner_radius:g} must be less than half of length and width; kind "
                "'capsule' has round ends."
            )

    def at(self, t: np.ndarray) -> np.ndarray:
        """See `Curve.at`."""
        return _rounded(t, self.length, self.width, self.corner_radius)


@dataclass(frozen=True)
class Capsule(Curve):
    """Two straight sides and two half circles, counter-clockwise from its easternmost point."""

    kind: Literal["capsule"]
    length: float  # of a straight side [m]
    radius: float  # of the ends [m]
    centre: Point = (0.0, 0.0)

    def __post_init__(self) -> None:
        positive(length=self.length, radius=self.radius)

    def at(self, t: np.ndarray) -> np.ndarray:
        """See `Curve.at`."""
        return _rounded(t, self.length + 2.0 * self.radius, 2.0 * self.radius, self.radius)


def _rounded(t: np.ndarray, length: float, width: float, radius: float) -> np.ndarray:
    """Points of a rectangle with round corners, at equal distances for equal steps of t, shape (n, 2) [m]."""
    along, across, arc = length - 2.0 * radius, width - 2.0 * radius, 0.5 * math.pi * radius
    ends = np.cumsum([0.0] + [across, arc, along, arc] * 2)
    walked = (np.asarray(t) % 1.0) * ends[-1]
    places = np.empty((len(walked), 2))
    corners = 0.5 * np.array([[along, across], [-along, across], [-along, -across], [along, -across]])
    sides = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])  # which way each edge lies
    for quarter, (corner, side) in enumerate(zip(corners, sides, strict=True)):
        begin, turns, end = ends[2 * quarter : 2 * quarter + 3]
        straight = (walked >= begin) & (walked <= turns)
        ahead = sides[(quarter + 1) % 4]
        places[straight] = corner + radius * side - (turns - walked[straight])[:, None] * ahead
        bent = (walked > turns) & (walked <= end)
        angle = 0.25 * quarter + 0.25 * (walked[bent] - turns) / arc
        places[bent] = corner + radius * on_circle(angle)
    return places
