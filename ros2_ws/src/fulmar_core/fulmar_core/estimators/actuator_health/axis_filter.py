"""Kalman gains of one axis of a body: pose, velocity, and acceleration by a push from outside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SETTLED = 1e-4  # relative change of a gain from step to step below which it stays


@dataclass(frozen=True, slots=True)
class Gains:
    """Of one step; arrays of shape (...,) of as many filters.

    Attributes:
        pose: Corrections of pose, velocity and push for an innovation of the pose, shape (3, ...).
        velocity: Same for one of the velocity.
        white: Three numbers that make innovations white, shape (3, ...): the first times that of the pose is the first
            white number, the second times that of the pose and the third times that of the velocity are the other.
        log_white: Logarithm of the determinant of these.
    """

    pose: np.ndarray
    velocity: np.ndarray
    white: np.ndarray
    log_white: np.ndarray

    def at(self, index: np.ndarray) -> Gains:
        """Those of some filters."""
        return Gains(
            self.pose[:, index], self.velocity[:, index], self.white[:, index], self.log_white[index]
        )


class AxisFilters:
    """Covariances of independent filters that are the same for whatever they filter.

    The covariance of a linear filter does not depend on what is measured (Kalman 1960).
    """

    def __init__(
        self, pose: np.ndarray, velocity: np.ndarray, model: np.ndarray, push: np.ndarray, drift: np.ndarray
    ) -> None:
        """Take standard deviations, each of shape (filters,).

        Args:
            pose: Of a measured pose [m or rad].
            velocity: Of a measured velocity [m/s or rad/s].
            model: Of an acceleration that the model leaves out, anew at each step [m/s² or rad/s²].
            push: Of the acceleration by the push, at the beginning, same unit.
            drift: Of its change in one second, same.
        """
        self._pose, self._velocity, self._model = pose**2, velocity**2, model**2
        self._push, self._drift = push**2, drift**2
        self.reset()

    def reset(self) -> None:
        """Know nothing of the push."""
        self._covariance = np.zeros((len(self._pose), 3, 3))
        self._covariance[:, 2, 2] = self._push
        self.restart()

    def restart(self) -> None:
        """Know pose and velocity from one measurement, and the push as before."""
        self._covariance[:, :2] = self._covariance[:, :, :2] = 0.0
        self._covariance[:, 0, 0], self._covariance[:, 1, 1] = self._pose, self._velocity
        self._last: Gains | None = None
        self._settled_at = (0.0, 0.0)

    def advance(self, dt: float, half: float) -> Gains:
        """Gains of one step; the same object as long as they do not change.

        Args:
            dt: Since the last step [s].
            half: How far a constant acceleration of 1 moves the body in it [s²].
        """
        if self._last is not None and self._settled_at == (dt, half):
            return self._last
        step = np.array([[1.0, dt, half], [0.0, 1.0, dt], [0.0, 0.0, 1.0]])
        driven = np.array([half, dt, 0.0])
        before = step @ self._covariance @ step.T + self._model[:, None, None] * np.outer(driven, driven)
        before[:, 2, 2] += dt * self._drift
        spread = before[:, :2, :2].copy()
        spread[:, 0, 0] += self._pose
        spread[:, 1, 1] += self._velocity
        gain = before[:, :, :2] @ np.linalg.inv(spread)
        after = before - gain @ before[:, :2]
        self._covariance = 0.5 * (after + np.swapaxes(after, 1, 2))
        white = np.linalg.inv(np.linalg.cholesky(spread))
        gains = Gains(
            gain[:, :, 0].T,
            gain[:, :, 1].T,
            np.stack((white[:, 0, 0], white[:, 1, 0], white[:, 1, 1])),
            np.log(white[:, 0, 0] * white[:, 1, 1]),
        )
        settled = self._last is not None and all(
            np.allclose(new, old, rtol=SETTLED, atol=1e-9)
            for new, old in ((gains.pose, self._last.pose), (gains.velocity, self._last.velocity))
        )
        self._settled_at = (dt, half) if settled else (0.0, 0.0)
        self._last = gains
        return gains
