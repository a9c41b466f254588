"""Points at equal distances along a curve; what all reference paths share."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import ClassVar

import numpy as np

from fulmar_core.config import strict_yaml as config

Point = tuple[float, float]  # x, y [m]

LARGEST = 10_000.0  # size of a path [m]
MOST_TURNS = 100  # or cycles or corners of a path; of a hypotrochoid before it closes
_FINEST = 40  # samples of a curve for each point asked for
_LEAST = 4000


def positive(**sizes: float) -> None:
    """Refuse sizes that are not greater than 0, and such as no robot drives.

    Raises:
        ValueError: Names the first such size.
    """
    config.positive(**sizes)
    for name, size in sizes.items():
        if size > LARGEST:
            raise ValueError(f"'{name}' must be at most {LARGEST:g}.")


def few(**turns: float) -> None:
    """Refuse more turns, cycles or corners than the points of a path can show.

    Raises:
        ValueError: Names the first such number.
    """
    for name, number in turns.items():
        if number > MOST_TURNS:
            raise ValueError(f"'{name}' must be at most {MOST_TURNS}.")


def along_curve(
    curve: Callable[[np.ndarray], np.ndarray], count: int, *, closed: bool, centre: Point
) -> np.ndarray:
    """Points as in `spread_along`, with the origin at a centre [m]."""
    return np.asarray(spread_along(curve, count, closed=closed) + np.array(centre))


def spread_along(curve: Callable[[np.ndarray], np.ndarray], count: int, *, closed: bool) -> np.ndarray:
    """Spread points over a smooth curve.

    Args:
        curve: Positions (n, 2 or 3) for parameters (n,) from 0 to 1 [m].
        count: How many points.
        closed: The curve ends where it began: the last point is one distance before the first, which is not
            repeated. Otherwise the last point is the curve's end.

    Returns:
        Points on the curve, shape (count, 2 or 3) [m]; distances along it are equal to about 1 part in 1,000.

    Raises:
        ValueError: Fewer than three points.
    """
    parameter = np.linspace(0.0, 1.0, max(_LEAST, _FINEST * count) + 1)
    walked = _walked(curve(parameter))
    at = np.interp(_stations(walked[-1], count, closed), walked, parameter)
    return np.asarray(curve(at))


class Curve(ABC):
    """A reference path along a smooth curve, closed unless it says otherwise."""

    centre: Point
    closed: ClassVar[bool] = True

    @abstractmethod
    def at(self, t: np.ndarray) -> np.ndarray:
        """Positions (n, 2) about the origin for parameters (n,) from 0 to 1 [m]."""

    def points(self, count: int) -> np.ndarray:
        """Equally spaced points, shape (count, 2) [m]; see `along_curve`."""
        return along_curve(self.at, count, closed=self.closed, centre=self.centre)


class Polygon(ABC):
    """A closed reference path along straight lines."""

    centre: Point
    closed: ClassVar[bool] = True

    @abstractmethod
    def vertices(self) -> np.ndarray:
        """Corners about the origin, shape (n, 2) [m]."""

    def points(self, count: int) -> np.ndarray:
        """Equally spaced points, shape (count, 2) [m]."""
        corners = self.vertices()
        corners = np.concatenate((corners, corners[:1]))
        walked = _walked(corners)
        at = _stations(walked[-1], count, closed=True)
        points = np.stack([np.interp(at, walked, corners[:, i]) for i in (0, 1)], axis=1)
        return np.asarray(points + np.array(self.centre))


def on_circle(turns: np.ndarray) -> np.ndarray:
    """Unit vectors at angles in turns, shape (..., 2)."""
    return np.stack((np.cos(2.0 * math.pi * turns), np.sin(2.0 * math.pi * turns)), axis=-1)


def _walked(points: np.ndarray) -> np.ndarray:
    """Length of the way to each point, shape (n,)."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return np.concatenate(([0.0], np.cumsum(steps)))


def _stations(length: float, count: int, closed: bool) -> np.ndarray:
    if count < 3:
        raise ValueError(f"a path needs at least 3 points, found {count}.")
    return np.linspace(0.0, length, count, endpoint=not closed)
