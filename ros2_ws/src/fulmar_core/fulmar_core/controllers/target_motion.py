"""Velocity, turn rate and accelerations of a target that moves, from one control step to the next."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fulmar_core.states.attitude import conjugate, logarithm, product
from fulmar_core.states.spatial import quat_of

ROUNDING = 1.001  # of targets that move as fast as they may


@dataclass(frozen=True)
class Moved:
    """How targets move, in the middle of the step before; each is 0 where it cannot be known."""

    motion: (
        np.ndarray
    )  # velocity in the world [m/s], turn rate about the target's own axes [rad/s], shape (n, 6)
    change: np.ndarray  # of it, same axes, shape (n, 6) [m/s², rad/s²]
    step_s: float  # since the target before [s]

    @property
    def at_end(self) -> np.ndarray:
        """The motion half a step later, which is now."""
        return self.motion + 0.5 * self.step_s * self.change


class TargetMotion:
    """Differences of the targets of n robots; a step that no target makes is a jump, and counts as standing still.

    Targets that stand still have exactly no motion.
    """

    def __init__(
        self, *, speed: float, rate: float, acceleration: float = math.inf, turning: float = math.inf
    ) -> None:
        """Begin without a target.

        Args:
            speed: Beyond it a target has jumped [m/s].
            rate: Same of its attitude [rad/s].
            acceleration: Beyond it a target does not bend: it came a step late or early [m/s²].
            turning: Same of its turn rate [rad/s²].
        """
        self._acceleration, self._turning = ROUNDING * acceleration, ROUNDING * turning
        self._speed, self._rate = ROUNDING * speed, ROUNDING * rate
        self._before: np.ndarray | None = None
        self._differences: tuple[np.ndarray, float] | None = None
        self._stamp_ns = 0

    def reset(self) -> None:
        """Forget the target."""
        self._before = self._differences = None

    def update(self, target: np.ndarray, stamp_ns: int, dt: float) -> Moved:
        """Take the targets of a step.

        Args:
            target: Poses, shape (n, 7).
            stamp_ns: When the step's state was measured; 0 or less without a clock [ns].
            dt: Time of one step, which counts without two stamps in order: none, or the same one again [s].

        Returns:
            How it moves.
        """
        passed_ns = stamp_ns - self._stamp_ns
        # After missed steps a target is as much further on as time is.
        elapsed = passed_ns / 1e9 if self._stamp_ns > 0 and passed_ns > 0 else dt
        before, self._before, self._stamp_ns = self._before, np.array(target, dtype=float), stamp_ns
        if before is None or before.shape != target.shape:
            self._differences = None
            unknown = np.zeros((len(target), 6))
            return Moved(unknown, unknown, elapsed)
        velocity = (target[:, :3] - before[:, :3]) / elapsed
        turned = product(conjugate(quat_of(before)), quat_of(target))
        still = np.all(before[:, 3:] == target[:, 3:], axis=-1)
        rate = np.where(still[:, None], 0.0, np.stack(logarithm(turned), axis=-1) / elapsed)
        follows = (np.linalg.norm(velocity, axis=-1) <= self._speed) & (
            np.linalg.norm(rate, axis=-1) <= self._rate
        )
        now = np.concatenate((velocity, rate), axis=-1) * follows[:, None]
        earlier, self._differences = self._differences, (now, elapsed)
        if earlier is None:
            return Moved(now, np.zeros_like(now), elapsed)
        # Of two steps that both follow; what begins or ends to move makes a jump of its velocity, and no acceleration.
        change = (now - earlier[0]) / (0.5 * (elapsed + earlier[1]))
        bends = (np.linalg.norm(change[:, :3], axis=-1) <= self._acceleration) & (
            np.linalg.norm(change[:, 3:], axis=-1) <= self._turning
        )
        return Moved(
            now, change * (bends & np.any(now, axis=-1) & np.any(earlier[0], axis=-1))[:, None], elapsed
        )
