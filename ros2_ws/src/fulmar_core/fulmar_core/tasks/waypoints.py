"""Waypoints at random, for tasks that visit one after another."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fulmar_core.counter_rng import Draws

CANDIDATES = 12  # places tried for each waypoint, then their mirror images; all fail for 2 courses in 100,000


@dataclass(frozen=True)
class Course:
    """A closed course of waypoints in a square."""

    count: int  # waypoints; after the last one the first comes again
    spacing: tuple[float, float]  # from each to the next [m]
    area: float  # side of the square [m]

    def __post_init__(self) -> None:
        """Refuse courses that do not fit."""
        if self.count < 2 or not 0.0 < self.spacing[0] <= self.spacing[1] or self.area < self.spacing[0]:
            raise ValueError(
                "'count' must be at least 2, 'spacing' [low, high] with 0 < low <= high <= area."
            )

    def draw(self, draws: Draws) -> np.ndarray:
        """Draw courses.

        Args:
            draws: One row for each.

        Returns:
            Waypoints, shape (worlds, count, 2) [m].
        """
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
    """Heading at each waypoint of a closed course: from the one before to the one after, shape (..., count) [rad]."""
    way = np.roll(places, -1, axis=-2) - np.roll(places, 1, axis=-2)
    return np.asarray(np.arctan2(way[..., 1], way[..., 0]))
