"""Figures of eight and their oval relative; formulas from Lawrence, "A Catalog of Special Plane Curves"."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from fulmar_core.references.spacing import Point, along_curve, on_circle, positive


@dataclass(frozen=True)
class BernoulliLemniscate:
    """(x² + y²)² = a² (x² - y²): x = a cos t / (1 + sin² t), y = x sin t."""

    kind: Literal["bernoulli_lemniscate"]
    half_width: float  # a: from the centre to the far end of a loop [m]
    centre: Point = (0.0, 0.0)

    closed: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Refuse a point."""
        positive(half_width=self.half_width)

    def points(self, count: int) -> np.ndarray:
        """Equally spaced points, shape (count, 2) [m]; see `along_curve`."""

        def curve(t: np.ndarray) -> np.ndarray:
            cos, sin = on_circle(t).T
            x = self.half_width * cos / (1.0 + sin * sin)
            return np.stack((x, x * sin), axis=1)

        return along_curve(curve, count, closed=True, centre=self.centre)


@dataclass(frozen=True)
class GeronoLemniscate:
    """x⁴ = a² (x² - y²): x = a cos t, y = a sin t cos t; half as high as it is wide."""

    kind: Literal["gerono_lemniscate"]
    half_width: float  # a [m]
    centre: Point = (0.0, 0.0)

    closed: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Refuse a point."""
        positive(half_width=self.half_width)

    def points(self, count: int) -> np.ndarray:
        """Equally spaced points, shape (count, 2) [m]; see `along_curve`."""

        def curve(t: np.ndarray) -> np.ndarray:
            cos, sin = on_circle(t).T
            return self.half_width * np.stack((cos, sin * cos), axis=1)

        return along_curve(curve, count, closed=True, centre=self.centre)


@dataclass(frozen=True)
class Hippopede:
    """Horse fetter: r² = 4 b (a - b sin² θ), an oval with a waist where a < 2 b.

    Its half width is 2 √(a b), its half height 2 √(b (a - b)).
    """

    kind: Literal["hippopede"]
    a: float  # [m]
    b: float  # smaller than a [m]
    centre: Point = (0.0, 0.0)

    closed: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Refuse what is no oval."""
        positive(b=self.b)
        if self.a <= self.b:
            raise ValueError("'a' must be greater than 'b', or the curve falls into two loops.")

    def points(self, count: int) -> np.ndarray:
        """Equally spaced points, shape (count, 2) [m]; see `along_curve`."""

        def curve(t: np.ndarray) -> np.ndarray:
            direction = on_circle(t)
            radius = np.sqrt(4.0 * self.b * (self.a - self.b * direction[:, 1:] ** 2))
            return np.asarray(radius * direction)

        return along_curve(curve, count, closed=True, centre=self.centre)
