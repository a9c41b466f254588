"""Random closed race tracks: corners, and a track with smooth corners."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from fulmar_core.states.counter_rng import Draws
from fulmar_core.tasks.references.spacing import Point, along_curve, positive

INNER = 0.4  # nearest that a corner comes to the middle, as a share of the farthest: our value
JITTER = 0.25  # how far a corner's bearing strays from even spacing, as a share of it: our value


def draw_corners(draws: Draws, *, fewest: int, most: int, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Draw corners at growing bearings around a middle, each at a distance of its own.

    The track turns by no more than 150° anywhere, for 9 to 13 corners, which keeps RoboRAN's rule of at least 12.5°
    between the ways in and out (tasks_cfg/race_waypoints_cfg.py) without drawing again.

    Args:
        draws: One row for each track; as many numbers are drawn whatever comes out.
        fewest: Corners, >= 3.
        most: Corners, >= `fewest`.
        size: Side of the square that a track fits into [m].

    Returns:
        Corners about the origin, shape (worlds, most, 2) [m], and how many of each row are meant, shape (worlds,).
    """
    count = np.floor(np.asarray(draws.uniform(fewest, most + 1.0))).astype(int)
    radius = 0.5 * size * np.asarray(draws.uniform(INNER, 1.0, most))
    stray = np.asarray(draws.uniform(-JITTER, JITTER, most))
    first = np.asarray(draws.uniform(-math.pi, math.pi))
    bearing = first[:, None] + 2.0 * math.pi / count[:, None] * (np.arange(most) + stray)
    return radius[..., None] * np.stack((np.cos(bearing), np.sin(bearing)), axis=-1), count


HANDLE = 0.2  # of the distance to the next corner: RoboRAN tasks_cfg, `rad`


@dataclass(frozen=True)
class RaceTrack:
    """Corners around a middle, as the racing tasks draw them, joined by cubic Bézier curves.

    Figures of the public RoboRAN tracks: 9 to 13 corners in a square of 15 m. At each corner the track runs in the
    direction halfway between the ways in and out.
    """

    kind: Literal["race_track"]
    seed: int  # >= 0; the same seed is the same track
    size: float = 15.0  # side of the square that corners are drawn from [m]
    corner_counts: tuple[int, int] = (9, 13)  # fewest and most
    centre: Point = (0.0, 0.0)

    closed: ClassVar[bool] = True

    def __post_init__(self) -> None:
        positive(size=self.size)
        fewest, most = self.corner_counts
        if not 3 <= fewest <= most <= 20:
            raise ValueError(
                f"'corner_counts' must be [fewest, most] within [3, 20], found [{fewest}, {most}]."
            )
        if self.seed < 0:
            raise ValueError("'seed' must not be negative.")

    def corners(self) -> np.ndarray:
        """Corners in the order of the track, shape (n, 2) [m]."""
        fewest, most = self.corner_counts
        draws = Draws.of_episode(self.seed, 0)
        corners, count = draw_corners(draws, fewest=fewest, most=most, size=self.size)
        return np.asarray(corners[0, : count[0]] + np.array(self.centre))

    def points(self, count: int) -> np.ndarray:
        """Equally spaced points, shape (count, 2) [m]; see `along_curve`."""
        corners = self.corners() - np.array(self.centre)
        after = np.roll(corners, -1, axis=0)
        length = np.linalg.norm(after - corners, axis=1, keepdims=True)
        way_out = (after - corners) / length
        middle = way_out + np.roll(way_out, 1, axis=0)
        heading = middle / np.linalg.norm(middle, axis=1, keepdims=True)
        reach = HANDLE * length
        bends = np.stack(
            (corners, corners + reach * heading, after - reach * np.roll(heading, -1, axis=0), after)
        )

        def curve(t: np.ndarray) -> np.ndarray:
            piece = np.minimum((t * len(corners)).astype(int), len(corners) - 1)
            s = (t * len(corners) - piece)[:, None]
            a, b, c, d = bends[:, piece]
            r = 1.0 - s
            return np.asarray(r**3 * a + 3.0 * r * r * s * b + 3.0 * r * s * s * c + s**3 * d)

        return along_curve(curve, count, closed=True, centre=self.centre)
