"""Reference curves in the plane; formulas from Lawrence, "A Catalog of Special Plane Curves"."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import ClassVar, Literal

import numpy as np

from fulmar_core.tasks.references.spacing import (
    LARGEST,
    MOST_TURNS,
    Curve,
    Point,
    Polygon,
    few,
    on_circle,
    positive,
)


@dataclass(frozen=True)
class Circle(Curve):
    """Counter-clockwise from its easternmost point: x = r cos t, y = r sin t."""

    kind: Literal["circle"]
    radius: float  # [m]
    centre: Point = (0.0, 0.0)

    def __post_init__(self) -> None:
        positive(radius=self.radius)

    def at(self, t: np.ndarray) -> np.ndarray:
        """See `Curve.at`."""
        return self.radius * on_circle(t)


@dataclass(frozen=True)
class Spiral(Curve):
    """Archimedean spiral: the radius grows evenly with the angle (Lawrence, "A Catalog of Special Plane Curves")."""

    kind: Literal["spiral"]
    start_radius: float  # [m]
    end_radius: float  # smaller than the start: inward [m]
    turns: float
    centre: Point = (0.0, 0.0)

    closed: ClassVar[bool] = False

    def __post_init__(self) -> None:
        positive(turns=self.turns)
        few(turns=self.turns)
        if min(self.start_radius, self.end_radius) < 0.0:
            raise ValueError("'start_radius' and 'end_radius' must not be negative.")
        if max(self.start_radius, self.end_radius) > LARGEST:
            raise ValueError(f"'start_radius' and 'end_radius' must be at most {LARGEST:g}.")
        if self.start_radius == self.end_radius:
            raise ValueError("'start_radius' and 'end_radius' must differ; kind 'circle' has one radius.")

    def at(self, t: np.ndarray) -> np.ndarray:
        """See `Curve.at`."""
        radius = self.start_radius + (self.end_radius - self.start_radius) * t
        return np.asarray(radius[:, None] * on_circle(self.turns * t))


@dataclass(frozen=True)
class Square(Polygon):
    """Counter-clockwise from its lower left corner."""

    kind: Literal["square"]
    side: float  # [m]
    centre: Point = (0.0, 0.0)

    def __post_init__(self) -> None:
        positive(side=self.side)

    def vertices(self) -> np.ndarray:
        """See `Polygon.vertices`."""
        return np.asarray(0.5 * self.side * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]))


@dataclass(frozen=True)
class InfiniteSquare(Polygon):
    """Two squares that share a corner at the centre, driven as a figure of eight.

    One lies to the upper right and is driven counter-clockwise, the other to the lower left and clockwise, so the
    path goes straight on through the centre.
    """

    kind: Literal["infinite_square"]
    side: float  # of each square [m]
    centre: Point = (0.0, 0.0)

    def __post_init__(self) -> None:
        positive(side=self.side)

    def vertices(self) -> np.ndarray:
        """See `Polygon.vertices`."""
        right = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
        left = [[0.0, 0.0], [0.0, -1.0], [-1.0, -1.0], [-1.0, 0.0]]
        return np.asarray(self.side * np.array(right + left))


@dataclass(frozen=True)
class Ngon(Polygon):
    """Regular polygon, counter-clockwise from a corner due east."""

    kind: Literal["ngon"]
    corners: int
    radius: float  # of the circle through the corners [m]
    centre: Point = (0.0, 0.0)

    def __post_init__(self) -> None:
        positive(radius=self.radius)
        if self.corners < 3:
            raise ValueError("'corners' must be 3 or more.")
        few(corners=self.corners)

    def vertices(self) -> np.ndarray:
        """See `Polygon.vertices`."""
        return np.asarray(self.radius * on_circle(np.arange(self.corners) / self.corners))


@dataclass(frozen=True)
class BernoulliLemniscate(Curve):
    """(x² + y²)² = a² (x² - y²): x = a cos t / (1 + sin² t), y = x sin t."""

    kind: Literal["bernoulli_lemniscate"]
    half_width: float  # a: from the centre to the far end of a loop [m]
    centre: Point = (0.0, 0.0)

    def __post_init__(self) -> None:
        positive(half_width=self.half_width)

    def at(self, t: np.ndarray) -> np.ndarray:
        """See `Curve.at`."""
        cos, sin = on_circle(t).T
        x = self.half_width * cos / (1.0 + sin * sin)
        return np.stack((x, x * sin), axis=1)


@dataclass(frozen=True)
class GeronoLemniscate(Curve):
    """x⁴ = a² (x² - y²): x = a cos t, y = a sin t cos t; half as high as it is wide."""

    kind: Literal["gerono_lemniscate"]
    half_width: float  # a [m]
    centre: Point = (0.0, 0.0)

    def __post_init__(self) -> None:
        positive(half_width=self.half_width)

    def at(self, t: np.ndarray) -> np.ndarray:
        """See `Curve.at`."""
        cos, sin = on_circle(t).T
        return self.half_width * np.stack((cos, sin * cos), axis=1)


@dataclass(frozen=True)
class Hippopede(Curve):
    """Horse fetter: r² = 4 b (a - b sin² θ), an oval with a waist where a < 2 b.

    Its half width is 2 √(a b), its half height 2 √(b (a - b)).
    """

    kind: Literal["hippopede"]
    a: float  # [m]
    b: float  # smaller than a [m]
    centre: Point = (0.0, 0.0)

    def __post_init__(self) -> None:
        positive(b=self.b)
        if self.a <= self.b:
            raise ValueError("'a' must be greater than 'b', or the curve falls into two loops.")

    def at(self, t: np.ndarray) -> np.ndarray:
        """See `Curve.at`."""
        direction = on_circle(t)
        radius = np.sqrt(4.0 * self.b * (self.a - self.b * direction[:, 1:] ** 2))
        return np.asarray(radius * direction)


@dataclass(frozen=True)
class Lissajous(Curve):
    """x = A sin(m t + φ), y = B sin(n t) (Lawrence, "A Catalog of Special Plane Curves")."""

    kind: Literal["lissajous"]
    half_width: float  # A [m]
    half_height: float  # B [m]
    x_cycles: int  # m
    y_cycles: int  # n
    phase_deg: float = 90.0  # φ [deg]
    centre: Point = (0.0, 0.0)

    def __post_init__(self) -> None:
        positive(
            half_width=self.half_width,
            half_height=self.half_height,
            x_cycles=self.x_cycles,
            y_cycles=self.y_cycles,
        )
        few(x_cycles=self.x_cycles, y_cycles=self.y_cycles)
        if math.gcd(self.x_cycles, self.y_cycles) > 1:
            raise ValueError(
                f"'x_cycles' and 'y_cycles' must have no common factor, found {self.x_cycles} and {self.y_cycles}."
            )
        if self._turns_back:
            raise ValueError(
                f"'phase_deg' = {self.phase_deg:g} makes an arc that is driven there and back of {self.x_cycles} to "
                f"{self.y_cycles} cycles. Give another."
            )

    @property
    def _turns_back(self) -> bool:
        """Whether x and y have an extreme at the same time: from there the curve comes back the way it came."""
        for extreme in range(2 * self.y_cycles):
            turns = self.x_cycles * (2 * extreme + 1) / (4 * self.y_cycles) + self.phase_deg / 360.0
            halves = 2.0 * (turns - 0.25)
            if abs(halves - round(halves)) < 1e-6:
                return True
        return False

    def at(self, t: np.ndarray) -> np.ndarray:
        """See `Curve.at`."""
        x = self.half_width * on_circle(self.x_cycles * t + self.phase_deg / 360.0)[:, 1]
        return np.stack((x, self.half_height * on_circle(self.y_cycles * t)[:, 1]), axis=1)


@dataclass(frozen=True)
class Hypotrochoid(Curve):
    """Drawn by a pen on a wheel that rolls inside a ring (Lawrence, "A Catalog of Special Plane Curves").

    x = (R - r) cos t + d cos((R - r) t / r), y = (R - r) sin t - d sin((R - r) t / r).
    """

    kind: Literal["hypotrochoid"]
    ring_radius: float  # R [m]
    wheel_radius: float  # r [m]
    pen_distance: float  # d, from the wheel's axle [m]
    centre: Point = (0.0, 0.0)

    def __post_init__(self) -> None:
        positive(ring_radius=self.ring_radius, wheel_radius=self.wheel_radius, pen_distance=self.pen_distance)
        if self.wheel_radius >= self.ring_radius:
            raise ValueError("'wheel_radius' must be smaller than 'ring_radius'.")
        if abs(float(self._ratio) - self.wheel_radius / self.ring_radius) > 1e-9:
            raise ValueError(
                f"'wheel_radius' / 'ring_radius' = {self.wheel_radius / self.ring_radius:g} must be a fraction of "
                f"whole numbers up to {MOST_TURNS}, or the curve does not close."
            )

    @property
    def _ratio(self) -> Fraction:
        """Wheel over ring; the numerator is the number of turns until the curve closes."""
        return Fraction(self.wheel_radius / self.ring_radius).limit_denominator(MOST_TURNS)

    def at(self, t: np.ndarray) -> np.ndarray:
        """See `Curve.at`."""
        turns, teeth = self._ratio.numerator, self._ratio.denominator
        axle = (self.ring_radius - self.wheel_radius) * on_circle(turns * t)
        return axle + self.pen_distance * on_circle((turns - teeth) * t)


@dataclass(frozen=True)
class Sine(Curve):
    """Wave along x, left to right, with its middle at the centre: y = A sin(2 π n s), 0 <= s <= 1."""

    kind: Literal["sine"]
    length: float  # along x [m]
    amplitude: float  # A [m]
    cycles: float  # n
    centre: Point = (0.0, 0.0)

    closed: ClassVar[bool] = False

    def __post_init__(self) -> None:
        positive(length=self.length, amplitude=self.amplitude, cycles=self.cycles)
        few(cycles=self.cycles)

    def at(self, t: np.ndarray) -> np.ndarray:
        """See `Curve.at`."""
        y = self.amplitude * on_circle(self.cycles * t)[:, 1]
        return np.stack((self.length * (t - 0.5), y), axis=1)
