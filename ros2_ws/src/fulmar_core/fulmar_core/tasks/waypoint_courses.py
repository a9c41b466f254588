"""Random waypoints of tasks: courses of even spacing, and race tracks."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fulmar_core.states.counter_rng import Draws
from fulmar_core.tasks.references.race_track import draw_corners

CANDIDATES = 12  # places tried for each waypoint, then their mirror images; all fail for 2 in 100,000


@dataclass(frozen=True)
class WaypointCourse:
    """A closed sequence of waypoints in a square."""

    count: int  # waypoints; after the last one the first comes again
    spacing: tuple[float, float]  # from each to the next [m]
    area: float  # side of the square [m]

    def __post_init__(self) -> None:
        if self.count < 2 or not 0.0 < self.spacing[0] <= self.spacing[1] or self.area < self.spacing[0]:
            raise ValueError(
                "'count' must be at least 2, 'spacing' [low, high] with 0 < low <= high <= area."
            )

    def draw(self, draws: Draws) -> np.ndarray:
        """Draw waypoints, shape (worlds, count, 2) [m]."""
        half, n = 0.5 * self.area, draws.worlds
        places = [np.asarray(draws.uniform(-half, half, 2))]
        low, high = self.spacing
        for i in range(1, self.count):
            distance = np.asarray(draws.uniform(low, high, CANDIDATES))
            angle = np.asarray(draws.uniform(-math.pi, math.pi, CANDIDATES))
            here = places[-1][:, None, :]
            step = np.stack((distance * np.cos(angle), distance * np.sin(angle)), axis=-1)
            inwards = np.where(np.abs(here + step) > half, -step, step)
            candidates = here + np.concatenate((step, inwards), axis=1)
            fits = np.all(np.abs(candidates) <= half, axis=-1)
            if i == self.count - 1:
                closing = np.linalg.norm(candidates - places[0][:, None, :], axis=-1)
                fits &= (closing >= low) & (closing <= high)
            first = np.argmax(fits, axis=1)
            places.append(np.clip(candidates[np.arange(n), first], -half, half))
        return np.stack(places, axis=1)


def headings_along(places: np.ndarray) -> np.ndarray:
    """Heading at each of closed waypoints: from the one before to the one after, shape (..., count) [rad]."""
    way = np.roll(places, -1, axis=-2) - np.roll(places, 1, axis=-2)
    return np.asarray(np.arctan2(way[..., 1], way[..., 0]))


@dataclass(frozen=True)
class RaceTrack:
    """A closed track at random, as `draw_corners` has it.

    Every track has as many waypoints as the most corners; where it has fewer corners, the middles of its longest
    straights are waypoints too. That lets tracks of any number of corners stand in one batch.
    """

    corners: tuple[int, int]  # fewest and most
    size: float  # side of the square that a track fits into [m]

    def __post_init__(self) -> None:
        if not 3 <= self.corners[0] <= self.corners[1] <= 2 * self.corners[0] or self.size <= 0.0:
            raise ValueError(
                "'corners' must be [fewest, most], 3 or more, at most twice as many; 'size' above 0."
            )

    def draw(self, draws: Draws) -> np.ndarray:
        """Draw waypoints in the order of driving, about the origin, shape (worlds, most corners, 2) [m]."""
        corners, count = draw_corners(draws, fewest=self.corners[0], most=self.corners[1], size=self.size)
        return _with_middles(corners, count)


def _with_middles(corners: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Fill up tracks of fewer corners with the middles of their longest straights.

    Args:
        corners: Shape (worlds, most, 2), of which the first `count` of each row are meant [m].
        count: Corners of each track, shape (worlds,).

    Returns:
        Waypoints in order, shape (worlds, most, 2) [m].
    """
    worlds, most = corners.shape[:2]
    row, place = np.arange(worlds)[:, None], np.arange(most)[None, :]
    meant = place < count[:, None]
    after = corners[row, np.where(place + 1 < count[:, None], place + 1, 0)]
    length = np.where(meant, np.linalg.norm(after - corners, axis=-1), -1.0)
    rank = np.argsort(np.argsort(-length, axis=1, kind="stable"), axis=1, kind="stable")
    halved = rank < most - count[:, None]
    at = place + np.cumsum(halved, axis=1) - halved  # where each corner comes to stand
    waypoints = np.empty_like(corners)
    which = np.nonzero(meant)
    waypoints[which[0], at[which]] = corners[which]
    which = np.nonzero(halved)
    waypoints[which[0], at[which] + 1] = 0.5 * (corners[which] + after[which])
    return waypoints
