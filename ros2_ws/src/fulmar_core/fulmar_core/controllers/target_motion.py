"""Velocity and turn rate of a target that moves, from one control step to the next."""

from __future__ import annotations

import numpy as np

from fulmar_core.states.attitude import conjugate, logarithm, product
from fulmar_core.states.spatial import quat_of

ROUNDING = 1.001  # of targets that move as fast as they may


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
        self._speed, self._rate = ROUNDING * speed, ROUNDING * rate
        self._before: np.ndarray | None = None
        self._stamp_ns = 0

    def reset(self) -> None:
        """Forget the target."""
        self._before = None

    def update(self, target: np.ndarray, stamp_ns: int, dt: float) -> tuple[np.ndarray, np.ndarray]:
        """Take the targets of a step.

        Args:
            target: Poses, shape (n, 7).
            stamp_ns: When the step's state was measured; 0 or less without a clock [ns].
            dt: Time of one step, which counts without two stamps in order: none, or the same one again [s].

        Returns:
            Velocity in the world [m/s], and turn rate about the target's own axes [rad/s], shapes (n, 3).
        """
        passed_ns = stamp_ns - self._stamp_ns
        # After missed steps a target is as much further on as time is.
        elapsed = passed_ns / 1e9 if self._stamp_ns > 0 and passed_ns > 0 else dt
        before, self._before, self._stamp_ns = self._before, np.array(target, dtype=float), stamp_ns
        if before is None or before.shape != target.shape:
            return np.zeros((len(target), 3)), np.zeros((len(target), 3))
        velocity = (target[:, :3] - before[:, :3]) / elapsed
        turned = product(conjugate(quat_of(before)), quat_of(target))
        still = np.all(before[:, 3:] == target[:, 3:], axis=-1)
        rate = np.where(still[:, None], 0.0, np.stack(logarithm(turned), axis=-1) / elapsed)
        follows = (np.linalg.norm(velocity, axis=-1) <= self._speed) & (
            np.linalg.norm(rate, axis=-1) <= self._rate
        )
        return velocity * follows[:, None], rate * follows[:, None]
