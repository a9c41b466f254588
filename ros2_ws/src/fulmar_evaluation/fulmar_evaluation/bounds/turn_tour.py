"""Discs to touch in order, and where and with which heading plans do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class TurnTour:
    """Discs of some episodes."""

    start: np.ndarray  # (E, 2) [m]
    yaw: np.ndarray | None  # (E,) heading at the start; None: any [rad]
    centres: np.ndarray  # (E, goals, 2) [m]
    radius: float  # [m]

    @property
    def approach(self) -> np.ndarray:
        """Direction from each disc to the one before, shape (E, goals) [rad]."""
        before = np.concatenate((self.start[:, None], self.centres[:, :-1]), axis=1)
        back = before - self.centres
        return np.asarray(np.arctan2(back[..., 1], back[..., 0]))

    def touch(self, angle: np.ndarray) -> np.ndarray:
        """Points of the discs' edges.

        Args:
            angle: From the x axis, shape (E, goals, n) [rad].

        Returns:
            Shape (E, goals, n, 2) [m].
        """
        edge = np.stack((np.cos(angle), np.sin(angle)), axis=-1)
        return np.asarray(self.centres[:, :, None] + self.radius * edge)

    def of(self, episodes: np.ndarray | slice, goals: int) -> TurnTour:
        """Some of the episodes, and the first goals."""
        yaw = None if self.yaw is None else self.yaw[episodes]
        return TurnTour(self.start[episodes], yaw, self.centres[episodes, :goals], self.radius)


@dataclass(frozen=True, slots=True)
class TurnPlan:
    """Where discs are touched, and headings there."""

    angle: np.ndarray  # (E, goals) of the touch on the disc's edge [rad]
    heading: np.ndarray  # (E, goals + 1) at the start and at each touch [rad]
    mode: np.ndarray  # (E, goals + 1) whether they are passed ahead (1), astern (-1) or at rest (0)

    def of(self, episodes: np.ndarray | slice) -> TurnPlan:
        """Some of the episodes."""
        return TurnPlan(self.angle[episodes], self.heading[episodes], self.mode[episodes])


def relative(before: np.ndarray, heading: np.ndarray, after: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far ahead and to the left a place lies; places have a last axis of x and y."""
    move = after - before
    c, s = np.cos(heading), np.sin(heading)
    return c * move[..., 0] + s * move[..., 1], c * move[..., 1] - s * move[..., 0]
