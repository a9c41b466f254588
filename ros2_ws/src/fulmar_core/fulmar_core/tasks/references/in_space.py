"""Reference paths in space, each given by a few sizes, and the attitudes along them.

A new path is one class, and a member of `SpacePath` below.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fulmar_core.states.attitude import from_euler, turn
from fulmar_core.tasks.references import ReferencePath
from fulmar_core.tasks.references.spacing import few, on_circle, positive, spread_along

Place = tuple[float, float, float]  # x, y, z [m]
TURNED = 0.7  # cosine of half the share of two circles in which their plane stands still [-]


class SpaceCurve(ABC):
    """A path in space, open unless it says otherwise."""

    centre: Place  # that a target on it may face

    @property
    def closed(self) -> bool:
        """Whether it ends where it began."""
        return False

    @abstractmethod
    def points(self, count: int) -> np.ndarray:
        """Equally spaced points, shape (count, 3) [m]; see `spread_along`."""

    @property
    @abstractmethod
    def up(self) -> np.ndarray:
        """Unit vector, nowhere along the path, that a body on it keeps its z axis nearest to, shape (3,)."""


class SmoothCurve(SpaceCurve):
    """One that a formula gives."""

    @abstractmethod
    def at(self, t: np.ndarray) -> np.ndarray:
        """Positions (n, 3) about the origin for parameters (n,) from 0 to 1 [m]."""

    def points(self, count: int) -> np.ndarray:
        """See `SpaceCurve.points`."""
        return np.asarray(spread_along(self.at, count, closed=self.closed) + np.array(self.centre))


@dataclass(frozen=True)
class Helix(SmoothCurve):
    """Screw about the world's z, upwards through its middle at the centre: x = r cos t, y = r sin t, z = p t / 2π."""

    kind: Literal["helix"]
    radius: float  # r [m]
    pitch: float  # p: rise in a turn [m]
    turns: float
    centre: Place = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        positive(radius=self.radius, pitch=self.pitch, turns=self.turns)
        few(turns=self.turns)

    def at(self, t: np.ndarray) -> np.ndarray:
        """See `SmoothCurve.at`."""
        flat = self.radius * on_circle(self.turns * t)
        return np.column_stack((flat, self.pitch * self.turns * (t - 0.5)))

    @property
    def up(self) -> np.ndarray:
        """See `SpaceCurve.up`."""
        return np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class TiltedCircle(SmoothCurve):
    """Circle that begins due east of its centre, in a plane that is turned about x; 90: upright."""

    kind: Literal["tilted_circle"]
    radius: float  # [m]
    tilt_deg: float = 0.0  # [deg]
    centre: Place = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        positive(radius=self.radius)

    @property
    def closed(self) -> bool:
        """See `SpaceCurve.closed`."""
        return True

    def at(self, t: np.ndarray) -> np.ndarray:
        """See `SmoothCurve.at`."""
        east, north = self.radius * on_circle(t).T
        tilt = math.radians(self.tilt_deg)
        return np.column_stack((east, north * math.cos(tilt), north * math.sin(tilt)))

    @property
    def up(self) -> np.ndarray:
        """See `SpaceCurve.up`."""
        tilt = math.radians(self.tilt_deg)
        return np.array([0.0, -math.sin(tilt), math.cos(tilt)])


@dataclass(frozen=True)
class Lifted(SpaceCurve):
    """A path of the plane, turned into space about its origin and put at a centre."""

    kind: Literal["lifted"]
    curve: ReferencePath
    angles_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)  # roll, pitch, yaw of its plane [deg]
    centre: Place = (0.0, 0.0, 0.0)

    @property
    def closed(self) -> bool:
        """See `SpaceCurve.closed`."""
        return self.curve.closed

    def points(self, count: int) -> np.ndarray:
        """See `SpaceCurve.points`."""
        x, y = self.curve.points(count).T
        quat = from_euler(*np.deg2rad(self.angles_deg))
        return np.asarray(np.stack(turn(quat, (x, y, 0.0 * x)), axis=1) + np.array(self.centre))

    @property
    def up(self) -> np.ndarray:
        """See `SpaceCurve.up`."""
        return np.array(turn(from_euler(*np.deg2rad(self.angles_deg)), (0.0, 0.0, 1.0)))


@dataclass(frozen=True)
class TwoCircles(SmoothCurve):
    """Two rounds on one sphere, in planes that are turned about x to either side; from one to the other at x's ends."""

    kind: Literal["two_circles"]
    radius: float  # [m]
    tilt_deg: float = 45.0  # of either plane [deg]
    centre: Place = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        positive(radius=self.radius)
        if not 0.0 < self.tilt_deg <= 45.0:
            raise ValueError(f"'tilt_deg' = {self.tilt_deg:g} must be greater than 0 and at most 45.")

    @property
    def closed(self) -> bool:
        """See `SpaceCurve.closed`."""
        return True

    def at(self, t: np.ndarray) -> np.ndarray:
        """See `SmoothCurve.at`."""
        share = (0.5 + np.cos(2.0 * math.pi * t) / (2.0 * TURNED)).clip(0.0, 1.0)
        smooth = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
        tilt = math.radians(self.tilt_deg) * (2.0 * smooth - 1.0)
        east, north = self.radius * on_circle(2.0 * t).T
        return np.column_stack((east, north * np.cos(tilt), north * np.sin(tilt)))

    @property
    def up(self) -> np.ndarray:
        """See `SpaceCurve.up`."""
        return np.array([0.0, 0.0, 1.0])


SpacePath = Helix | TiltedCircle | Lifted | TwoCircles
