"""What an episode is about: targets in their order, and things that stand about."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.arrays import array_namespace
from fulmar_core.planar import PlanarState
from fulmar_core.rotation import Array


@dataclass(frozen=True, slots=True)
class Goal:
    """Targets of one episode, or of many at once.

    A target is a pose (x [m], y [m], yaw [rad]) in the world, or, for tasks that track velocities, a velocity
    (ahead [m/s], to the left [m/s], turn rate [rad/s]) in the body's frame.
    """

    targets: Array  # (..., k, 3), k >= 1; after the last one the first comes again
    done: Array  # (...,) targets already reached, whole numbers
    # (..., m, 3 or more) x [m], y [m], radius [m] of discs, and what a task adds to them; m may be 0, a radius of 0 is
    # no obstacle.
    obstacles: Array
    block: Array  # (..., 2) place that moves: of the thing to push; with gates, of the robot a step ago [m]

    def write(self, index: Any, other: Goal) -> None:
        """Overwrite some worlds of a batch in place."""
        for name in ("targets", "done", "obstacles", "block"):
            getattr(self, name)[index] = getattr(other, name)

    def __getitem__(self, index: Any) -> Goal:
        """Pick worlds out of a batch."""
        return Goal(self.targets[index], self.done[index], self.obstacles[index], self.block[index])

    @property
    def current(self) -> Array:
        """Target that counts now, shape (..., 3)."""
        return self.ahead(0)

    def ahead(self, further: int) -> Array:
        """Target that comes after some others.

        Args:
            further: 0 for the current one.

        Returns:
            Shape (..., 3).
        """
        count = self.targets.shape[-2]
        if count == 1:
            return self.targets[..., 0, :]
        xp = array_namespace(self.targets)
        which = xp.astype((self.done + further) % count, xp.int64)
        if which.ndim == 0:
            return self.targets[int(which)]
        if which.ndim == 1:
            return self.targets[xp.arange(which.shape[0]), which]
        return xp.take_along_axis(self.targets, which[..., None, None], axis=-2)[..., 0, :]


def no_obstacles(worlds: int, count: int = 0) -> np.ndarray:
    """Obstacles of worlds that have none, shape (worlds, count, 3)."""
    return np.zeros((worlds, count, 3))


def goal_at(*targets: tuple[float, float, float], obstacles: np.ndarray | None = None) -> Goal:
    """A goal without a batch axis.

    Args:
        targets: Poses (x [m], y [m], yaw [rad]) or body velocities, at least one.
        obstacles: Discs, shape (m, 3); none by default.
    """
    return Goal(
        np.array(targets, dtype=float),
        np.asarray(0.0),
        np.zeros((0, 3)) if obstacles is None else np.asarray(obstacles, dtype=float),
        np.zeros(2),
    )


def goals_at(targets: Array) -> Goal:
    """A batch of goals with one target each.

    Args:
        targets: Poses or body velocities as of `Goal`, shape (n, 3).
    """
    zero = array_namespace(targets).zeros_like(targets[:, 0])
    return Goal(targets[:, None, :], zero, no_obstacles(len(targets)), targets[:, :2] * 0.0)


def stack_goals(goals: list[Goal]) -> Goal:
    """Join single goals into a batch along a new first axis."""
    return Goal(*(np.stack([getattr(g, name) for g in goals]) for name in Goal.__slots__))


def goal_in_float64(goal: Goal) -> Goal:
    """The same goal as NumPy arrays of float64."""
    return Goal(*(np.asarray(getattr(goal, name), dtype=float) for name in Goal.__slots__))


def offset_to(state: PlanarState, target: Array) -> tuple[Array, Array]:
    """Vector from a body to a target in the world, shapes (...,) [m]."""
    return target[..., 0] - state.x, target[..., 1] - state.y
