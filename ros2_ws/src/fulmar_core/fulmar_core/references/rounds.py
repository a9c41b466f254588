"""Paths about a centre: circle and spiral."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from fulmar_core.references.spacing import LARGEST, Point, along_curve, few, on_circle, positive


@dataclass(frozen=True)
class Circle:
    """Counter-clockwise from its easternmost point: x = r cos t, y = r sin t."""

    kind: Literal["circle"]
    radius: float  # [m]
    centre: Point = (0.0, 0.0)

    closed: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Refuse a point."""
        positive(radius=self.radius)

    def points(self, count: int) -> np.ndarray:
        """Equally spaced points, shape (count, 2) [m]; see `along_curve`."""
        return along_curve(lambda t: self.radius * on_circle(t), count, closed=True, centre=self.centre)


@dataclass(frozen=True)
class Spiral:
    """Archimedean spiral: the radius grows evenly with the angle (Lawrence, "A Catalog of Special Plane Curves")."""

    kind: Literal["spiral"]
    start_radius: float  # [m]
    end_radius: float  # smaller than the start: inward [m]
    turns: float
    centre: Point = (0.0, 0.0)

    closed: ClassVar[bool] = False

    def __post_init__(self) -> None:
        """Refuse circles and negative radii."""
        positive(turns=self.turns)
        few(turns=self.turns)
        if min(self.start_radius, self.end_radius) < 0.0:
            raise ValueError("'start_radius' and 'end_radius' must not be negative.")
        if max(self.start_radius, self.end_radius) > LARGEST:
            raise ValueError(f"'start_radius' and 'end_radius' must be at most {LARGEST:g}.")
        if self.start_radius == self.end_radius:
            raise ValueError("'start_radius' and 'end_radius' must differ; kind 'circle' has one radius.")

    def points(self, count: int) -> np.ndarray:
        """Equally spaced points, shape (count, 2) [m]; see `along_curve`."""

        def curve(t: np.ndarray) -> np.ndarray:
            radius = self.start_radius + (self.end_radius - self.start_radius) * t
            return np.asarray(radius[:, None] * on_circle(self.turns * t))

        return along_curve(curve, count, closed=False, centre=self.centre)
