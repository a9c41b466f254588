"""Discs that stand in a robot's way, for the sums of the envelope guard and for where it stops."""

from __future__ import annotations

import numpy as np

from fulmar_core.dynamics.contact import outline_of
from fulmar_core.robots.robot import Robot

NAME = "obstacle"
CLEAR_M = 0.3  # of a point to stop at, from the edge of a disc to that of the robot [m]
TINY_M = 1e-9


class Blocks:
    """Discs in the plane, shape (n, m, 3) for n robots: x [m], y [m] and radius [m], which is 0 for none."""

    def __init__(self, robot: Robot) -> None:
        """Take how far the robot reaches."""
        self._extent = outline_of(robot).extent

    def gaps(self, place: np.ndarray, target: np.ndarray, discs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Least gap between each disc and the robot on a straight way, infinite for none, and the share of the way.

        Args:
            place: Where the ways begin, shape (n, 3) [m].
            target: Where they end, shape (n, 3) [m].
            discs: See the class.

        Returns:
            Gaps [m], and how far along the way each is, 0 to 1 [-], shapes (n, m).
        """
        along, to_disc = (target - place)[:, None, :2], discs[..., :2] - place[:, None, :2]
        length2 = np.maximum((along * along).sum(axis=2), TINY_M**2)
        share = ((to_disc * along).sum(axis=2) / length2).clip(0.0, 1.0)
        off = to_disc - share[..., None] * along
        gap = np.sqrt((off * off).sum(axis=2)) - discs[..., 2] - self._extent
        there = discs[..., 2] > 0.0
        return np.where(there, gap, np.inf), np.where(there, share, 0.0)

    def clear(self, place: np.ndarray, discs: np.ndarray) -> np.ndarray:
        """Points to stop at, moved straight out of discs that they are too near to, shape (n, 3) [m]."""
        moved = np.array(place)
        for number in range(discs.shape[1]):
            disc = discs[:, number]
            away = moved[:, :2] - disc[:, :2]
            length = np.sqrt((away * away).sum(axis=1))
            free = disc[:, 2] + self._extent + CLEAR_M
            near = (disc[:, 2] > 0.0) & (length < free)
            out = disc[:, :2] + away * (free / np.maximum(length, TINY_M))[:, None]
            moved[:, :2] = np.where(near[:, None], out, moved[:, :2])
        return moved

    def crosses(self, place: np.ndarray, target: np.ndarray, discs: np.ndarray) -> np.ndarray:
        """Whether the straight way from places to targets, shapes (n, 3), touches a disc, shape (n,)."""
        return np.asarray((self.gaps(place, target, discs)[0] < 0.0).any(axis=1))
