"""Race tracks for tasks that visit waypoints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.counter_rng import Draws
from fulmar_core.references.race_corners import draw_corners


@dataclass(frozen=True)
class RaceTrack:
    """A closed track at random, as `draw_corners` has it.

    Every track has as many waypoints as the most corners; where it has fewer corners, the middles of its longest
    straights are waypoints too. That lets tracks of any number of corners stand in one batch.
    """

    corners: tuple[int, int]  # fewest and most
    size: float  # side of the square that a track fits into [m]

    def __post_init__(self) -> None:
        """Refuse tracks that enclose nothing."""
        if not 3 <= self.corners[0] <= self.corners[1] <= 2 * self.corners[0] or self.size <= 0.0:
            raise ValueError(
                "'corners' must be [fewest, most], 3 or more, at most twice as many; 'size' above 0."
            )

    def draw(self, draws: Draws) -> np.ndarray:
        """Draw tracks.

        Args:
            draws: One row for each.

        Returns:
            Waypoints in the order of driving, about the origin, shape (worlds, most corners, 2) [m].
        """
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
