"""Extended Kalman filter of turn rate and inertia.

The state is the turn rate, the torque from outside, and the inertia's numbers as shares of a first guess. Euler's
equation with the measured momentum of the wheels predicts the turn rate, and a gyroscope measures it. Without the
torque as a state, that of gravity would move the inertia wherever nothing else is excited. The inertia walks: noise
that is a share of the inertia per √s suits satellites of any size, where one density for all (1e-5 kg·m²/√s in the
public code of arXiv 2510.16738) is a quarter of a CubeSat's inertia in 300 s.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from fulmar_core.estimators.inertia.momentum_balance import tensor_of

RATE, TORQUE, SHARES = slice(0, 3), slice(3, 6), slice(6, None)  # of the state
OWN = 6  # states before those of the inertia
PRODUCTS = ((0, 1), (0, 2), (1, 2))  # axes of xy, xz and yz
STEP = 1e-5  # of numeric slopes, as a share [-]
LEAST, MOST = 0.05, 20.0  # shares of the guess that an inertia may have
QUIET_S, QUIET = (
    5.0,
    20.0,
)  # an axis whose momentum changes by less than so many of its noise in so long is quiet


@dataclass(frozen=True)
class EkfSettings:
    """What the filter believes of noise."""

    gyroscope_std: float  # of a reading [rad/s]
    momentum_std: float  # of the wheels' momentum in a reading, each axis [N·m·s]
    spread: float = 0.3  # standard deviation of the guess, as a share [-]
    walk: float = 5e-3  # of the inertia, as a share [1/√s]
    torque: float = (
        3e-5  # size of torques from outside: of gravity, sunlight and what is left of the field [N·m]
    )
    torque_s: float = 100.0  # time in which they change by as much, as the body turns [s]


class InertiaFilter:
    """Predicts from one sample to the next, and corrects by the turn rate of the next.

    Where the momentum of an axis has not changed for a while, its moment stays as it is: what a filter would learn from
    then is the noise of the wheels, as if it were their motion, and the moment would grow without end.

    Attributes:
        x: Turn rate [rad/s], torque from outside [N·m], numbers of the inertia as shares of the guess.
        P: Covariance of these.
        changed: Normalised innovation squared of the newest sample, of three degrees of freedom.
        excited: Of each axis, whether its momentum changes.
    """

    def __init__(self, first: np.ndarray, settings: EkfSettings) -> None:
        """Begin with a guess of the inertia's numbers, shape (count,) [kg·m²]."""
        count = len(first)
        self._first, self._settings = np.asarray(first, dtype=float), settings
        # Products of inertia are guessed as 0: they count as shares of the moments' mean.
        self._unit = np.where(np.arange(count) < 3, self._first, float(np.mean(self._first[:3])))
        self.x = np.concatenate((np.zeros(OWN), self._first / self._unit))
        spread = (np.ones(3), np.full(3, settings.torque), np.full(count, settings.spread))
        self.P = np.diag(np.concatenate(spread) ** 2)
        self._noise = settings.gyroscope_std**2 * np.eye(3)
        self._rows = np.eye(3, OWN + count)
        self._recent: deque[tuple[float, np.ndarray]] = (
            deque()
        )  # when, and momentum of the wheels; oldest first
        self.changed, self.excited = 0.0, np.zeros(3, dtype=bool)

    @property
    def numbers(self) -> np.ndarray:
        """Numbers of the inertia, shape (count,) [kg·m²]."""
        return np.asarray(self.x[SHARES] * self._unit)

    @property
    def covariance(self) -> np.ndarray:
        """Of these, shape (count, count)."""
        return np.asarray(self.P[SHARES, SHARES] * np.outer(self._unit, self._unit))

    def add(self, rate: np.ndarray, momentum: np.ndarray, time_s: float) -> None:
        """Take a sample: turn rate [rad/s] and momentum of the wheels in the body frame [N·m·s], shapes (3,)."""
        before = self._recent[-1] if self._recent else None
        self._recent.append((time_s, np.array(momentum, dtype=float)))
        while self._recent[0][0] < time_s - QUIET_S:
            self._recent.popleft()
        if before is None:
            self.x[RATE] = rate
            self.P[RATE, RATE] = self._noise
            return
        moved = np.abs(momentum - self._recent[0][1])
        self.excited = moved >= QUIET * max(self._settings.momentum_std, 1e-12)
        self._predict(before[1], np.asarray(momentum), time_s - before[0])
        innovation = np.asarray(rate) - self.x[RATE]
        self.x, self.P, spread = kalman_update(
            self.x, self.P, innovation, self._rows, self._noise, frozen=self._frozen()
        )
        self.changed = float(innovation @ np.linalg.solve(spread, innovation))
        # No inertia is negative or many times the guess; what tried to be is uncertain.
        moments = self.x[OWN : OWN + 3]
        if (moments < LEAST).any() or (moments > MOST).any():
            self.x[OWN : OWN + 3] = np.clip(moments, LEAST, MOST)
            self.forget()

    def _frozen(self) -> np.ndarray:
        """Numbers of the states that a sample does not change."""
        count = len(self._first)
        quiet = [i for i in range(3) if not self.excited[i]]
        quiet += [
            k
            for k, (a, b) in enumerate(PRODUCTS, 3)
            if k < count and not (self.excited[a] or self.excited[b])
        ]
        return OWN + np.array(quiet, dtype=int)

    def forget(self) -> None:
        """Believe the inertia no more than at the start."""
        self.P[SHARES, :OWN], self.P[:OWN, SHARES] = 0.0, 0.0
        self.P[SHARES, SHARES] = self._settings.spread**2 * np.eye(len(self._first))

    def _predict(self, h0: np.ndarray, h1: np.ndarray, dt: float) -> None:
        """Move the state on while the momentum of the wheels changes linearly from h0 to h1."""
        size = len(self.x)
        states = np.tile(self.x, (2 * size + 1, 1))
        step = STEP * np.concatenate((np.full(3, 1e-2), np.full(3, 1.0), np.ones(size - OWN)))
        states[1 : size + 1] += np.diag(step)
        states[size + 1 :] -= np.diag(step)
        moved = _moved(states, self._unit, h0, h1, dt)
        F = ((moved[1 : size + 1] - moved[size + 1 :]) / (2.0 * step[:, None])).T
        s, lightness = self._settings, np.linalg.inv(tensor_of(self.numbers))
        Q = np.zeros((size, size))
        Q[RATE, RATE] = 2.0 * s.momentum_std**2 * lightness @ lightness.T
        Q[TORQUE, TORQUE] = s.torque**2 * dt / s.torque_s * np.eye(3)
        Q[SHARES, SHARES] = (
            s.walk**2 * dt * np.diag(np.where(np.arange(size - OWN) < 3, self.x[SHARES] ** 2, 1.0))
        )
        self.x, self.P = moved[0], F @ self.P @ F.T + Q


def kalman_update(
    x: np.ndarray,
    P: np.ndarray,
    innovation: np.ndarray,
    H: np.ndarray,
    R: np.ndarray,
    *,
    frozen: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Kalman's correction in Joseph's form, which holds for any gain.

    Args:
        x: State, shape (n,).
        P: Its covariance, shape (n, n).
        innovation: Measured less expected, shape (m,).
        H: Slopes of the measurement, shape (m, n).
        R: Its noise, shape (m, m).
        frozen: Numbers of states that stay as they are; none by default.

    Returns:
        State and covariance after it, and the covariance of the innovation.
    """
    spread = H @ P @ H.T + R
    gain = np.linalg.solve(spread, H @ P).T
    if frozen is not None:
        gain[frozen] = 0.0
    left = np.eye(len(x)) - gain @ H
    return x + gain @ innovation, left @ P @ left.T + gain @ R @ gain.T, spread


def _moved(states: np.ndarray, unit: np.ndarray, h0: np.ndarray, h1: np.ndarray, dt: float) -> np.ndarray:
    """States after a step by Runge-Kutta's method, shape (k, n)."""
    count, slope = len(unit), (h1 - h0) / dt
    numbers, torque = states[:, SHARES] * unit, states[:, TORQUE]
    tensors = np.zeros((len(states), 3, 3))
    index = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    for i in range(count):
        a, b = index[i]
        tensors[:, a, b] = tensors[:, b, a] = numbers[:, i]
    inverse = np.linalg.inv(tensors)

    def turning(rate: np.ndarray, momentum: np.ndarray) -> np.ndarray:
        carried = np.einsum("kij,kj->ki", tensors, rate) + momentum
        return np.asarray(np.einsum("kij,kj->ki", inverse, torque - slope - np.cross(rate, carried)))

    rate, middle = states[:, RATE], 0.5 * (h0 + h1)
    k1 = turning(rate, h0)
    k2 = turning(rate + 0.5 * dt * k1, middle)
    k3 = turning(rate + 0.5 * dt * k2, middle)
    k4 = turning(rate + dt * k3, h1)
    after = states.copy()
    after[:, RATE] = rate + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return after
