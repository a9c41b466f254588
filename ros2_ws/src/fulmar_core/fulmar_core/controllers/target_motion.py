"""Velocity and turn rate of a target that moves, from one control step to the next."""

from __future__ import annotations

import numpy as np

from fulmar_core.attitude import conjugate, logarithm, product
from fulmar_core.spatial import quat_of


class TargetMotion:
    """Differences of the targets of n robots; a step that no target makes is a jump, and counts as standing still.

    Targets that stand still have exactly no motion.
    """

    def __init__(self, *, speed: float, rate: float) -> None:
        """Begin without a target.

        Args:
            speed: Beyond it a target has jumped [m/s].
            rate: Same of its attitude [rad/s].
        """
        self._speed, self._rate = speed, rate
        self._before: np.ndarray | None = None

    def reset(self) -> None:
        """Forget the target."""
        self._before = None

    def update(self, target: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
        """Take the targets of a step.

        Args:
            target: Poses, shape (n, 7).
            dt: Time since the step before [s].

        Returns:
            Velocity in the world [m/s], and turn rate about the target's own axes [rad/s], shapes (n, 3).
        """
        before, self._before = self._before, np.array(target, dtype=float)
        if before is None or before.shape != target.shape:
            return np.zeros((len(target), 3)), np.zeros((len(target), 3))
        velocity = (target[:, :3] - before[:, :3]) / dt
        turned = product(conjugate(quat_of(before)), quat_of(target))
        still = np.all(before[:, 3:] == target[:, 3:], axis=-1)
        rate = np.where(still[:, None], 0.0, np.stack(logarithm(turned), axis=-1) / dt)
        follows = (np.linalg.norm(velocity, axis=-1) <= self._speed) & (
            np.linalg.norm(rate, axis=-1) <= self._rate
        )
        return velocity * follows[:, None], rate * follows[:, None]
