"""Motion in space as a multiplicative extended Kalman filter: poses and attitudes correct what an inertial unit drives.

The errors of position, velocity, attitude and of the unit's biases are filtered by filterpy; the attitude itself is a
unit quaternion that errors multiply. Solà, "Quaternion kinematics for the error-state Kalman filter", arXiv 1711.02508:
the model is that of section 5 with the attitude's error in the body's frame; corrections are those of section 6.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from fulmar_core.estimators.motion import filter as events
from fulmar_core.estimators.motion.filter import Filter, Placed
from fulmar_core.estimators.motion.kalman import LeanKalmanFilter
from fulmar_core.estimators.motion.settings import SpatialMotionSettings
from fulmar_core.robots.sensors.imu import ImuSample
from fulmar_core.states.attitude import exponential, normalised, product, rotation_error, turn
from fulmar_core.states.gravity import GRAVITY
from fulmar_core.states.rotation import size_of

ERRORS = 15
PLACE, VELOCITY, TURN, FORCE_BIAS, RATE_BIAS = (slice(i, i + 3) for i in range(0, ERRORS, 3))
SPREAD_AT_START = (1.0, 1.0, 1.0, 0.05, 1.0)  # m, m/s, rad, m/s², rad/s without an inertial reading
RATE_BIAS_STD = 0.02  # of a gyroscope whose readings begin [rad/s]
_ONE, _SAME = np.eye(3), np.eye(ERRORS)
_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_POSE_ROWS = np.eye(ERRORS)[[0, 1, 2, 6, 7, 8]]
_TURN_ROWS = np.eye(ERRORS)[TURN]


class Belief(NamedTuple):
    """What is believed beside the covariance."""

    position: np.ndarray  # (3,) [m]
    velocity: np.ndarray  # (3,) in the world [m/s]
    quat_xyzw: np.ndarray  # (4,)
    force_bias: np.ndarray  # (3,) of the accelerometer [m/s²]
    rate_bias: np.ndarray  # (3,) of the gyroscope [rad/s]
    rate: np.ndarray  # (3,) turn rate in the body [rad/s]
    measured: (
        bool  # whether it comes from an inertial reading; else poses and attitudes correct it as they turn
    )


class SpatialFilter(LeanKalmanFilter, Filter):
    """Position, velocity, attitude and biases; `x` holds their errors, which are zero between corrections.

    A turn rate that comes from no inertial reading is off by the negative of the error in the place of the gyroscope's
    bias, as one that does.

    Events: a pose, shape (7,); an `ImuSample`; an attitude with its covariance about the body's axes, shapes (4,) and
    (3, 3) [rad²].
    """

    def __init__(
        self, settings: SpatialMotionSettings, pose: np.ndarray, *, weighs: bool, speed: float
    ) -> None:
        """Begin at a pose, knowing little else.

        Args:
            settings: What to believe of the sensors.
            pose: Shape (7,).
            weighs: Whether gravity pulls the body, which no sensor feels.
            speed: With which it may begin, 0 where it begins at rest [m/s].
        """
        super().__init__(dim_x=ERRORS, dim_z=6)
        self._settings, self._weighs = settings, weighs
        zero = np.zeros(3)
        self.belief = Belief(pose[:3], zero, _unit(pose[3:]), zero, zero, zero, measured=False)
        self.x = np.zeros(ERRORS)
        spread = np.repeat(SPREAD_AT_START, 3)
        spread[PLACE], spread[TURN] = settings.position_std, settings.attitude_std
        spread[VELOCITY] = max(SPREAD_AT_START[1], speed)
        self.P = np.diag(spread**2)
        self._pose_noise = np.diag(np.repeat((settings.position_std**2, settings.attitude_std**2), 3))

    def move_on(self, seconds: float, inertial: ImuSample | None) -> None:
        """Predict by a reading of the inertial unit; see `Filter.move_on`."""
        if seconds <= 0.0:
            return
        has_rate = inertial is not None and inertial.has_rate
        has_force = inertial is not None and inertial.has_force
        if has_rate:
            self._begin_to_measure()
        t, s, now = seconds, self._settings, self.belief
        rate, force, noise = now.rate, np.zeros(3), s.manoeuvre
        if inertial is not None and has_rate:
            rate = inertial.angular_velocity - now.rate_bias
        if inertial is not None and has_force:
            force, noise = inertial.specific_force - now.force_bias, s.acceleration_noise
        quat = _quat(now.quat_xyzw)
        axes = _axes(quat).T  # body to world
        push = axes @ force
        if self._weighs and has_force:
            push = push - np.array([0.0, 0.0, GRAVITY])
        a, b, c, d = exponential(tuple((t * rate).tolist()))
        turned = float(a), float(b), float(c), float(d)
        F = _steady(t).copy()
        if has_force:
            lever = -axes @ _skew(force)
            np.multiply(0.5 * t * t, lever, out=F[PLACE, TURN])
            np.multiply(t, lever, out=F[VELOCITY, TURN])
            np.multiply(-0.5 * t * t, axes, out=F[PLACE, FORCE_BIAS])
            np.multiply(-t, axes, out=F[VELOCITY, FORCE_BIAS])
        F[TURN, TURN] = _axes(turned)  # of the inverse rotation: rows are turned axes
        self.F, self.Q = F, _noise(s, t, noise, measured=has_rate)
        self.belief = Belief(
            now.position + t * now.velocity + 0.5 * t * t * push,
            now.velocity + t * push,
            np.array(normalised(product(quat, turned))),
            now.force_bias,
            now.rate_bias,
            rate,
            measured=has_rate,
        )
        self.predict()

    def predict_x(self, u: Any = 0) -> None:
        """Errors stay zero: the belief itself has moved."""

    def correct(self, kind: int, value: Any) -> None:
        """Correct by an event; an inertial reading has moved the filter to its time already."""
        if kind == events.IMU:
            if value.has_rate:
                self._begin_to_measure()
                rate = value.angular_velocity - self.belief.rate_bias
                self.belief = self.belief._replace(rate=rate, measured=True)
            return
        residual, rows, noise = self._residual(kind, value)
        self.update(residual, lambda _x: rows, lambda x: rows @ x, R=noise)
        self._inject()

    def distance2(self, kind: int, value: Any) -> float:
        """See `Filter.distance2`."""
        residual, rows, noise = self._residual(kind, value)
        return float(residual @ np.linalg.solve(rows @ self.P @ rows.T + noise, residual))

    def snapshot(self) -> tuple[Belief, np.ndarray]:
        """Belief and covariance."""
        return self.belief, self.P  # both are replaced, and changed neither in place

    def restore(self, snapshot: tuple[Belief, np.ndarray]) -> None:
        """Go back."""
        self.belief, self.P = snapshot

    def speed_std(self) -> float:
        """See `Filter.speed_std`."""
        return math.sqrt(max(self.P.diagonal()[VELOCITY].tolist()))

    def rate_std(self) -> float:
        """See `Filter.rate_std`."""
        return math.sqrt(max(self.P.diagonal()[RATE_BIAS].tolist()))

    def placed(self) -> Placed:
        """See `Filter.placed`."""
        return self.belief.position, self.belief.quat_xyzw

    def biases(self) -> tuple[float, float]:
        """See `Filter.biases`."""
        return size_of(self.belief.force_bias), size_of(self.belief.rate_bias)

    def keep_biases(self, other: SpatialFilter) -> None:
        """See `Filter.keep_biases`; the turn rate, too, which has the error of the gyroscope's bias."""
        theirs, P, biases = other.belief, self.P.copy(), slice(FORCE_BIAS.start, RATE_BIAS.stop)
        P[biases, biases] = other.P[biases, biases]
        self.belief = self.belief._replace(
            force_bias=theirs.force_bias,
            rate_bias=theirs.rate_bias,
            rate=theirs.rate,
            measured=theirs.measured,
        )
        self.P = P

    def velocity(self) -> np.ndarray:
        """See `Filter.velocity`."""
        return self.belief.velocity

    def turn_rate(self) -> float:
        """See `Filter.turn_rate`."""
        return size_of(self.belief.rate)

    def separation(self, other: SpatialFilter) -> tuple[np.ndarray, np.ndarray]:
        """See `Filter.separation`."""
        a, b = self.belief, other.belief
        angle = rotation_error(_quat(b.quat_xyzw), _quat(a.quat_xyzw))
        return np.concatenate((a.position - b.position, a.velocity - b.velocity, angle)), other.P[:9, :9]

    def _residual(self, kind: int, value: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Measured less expected, the rows of the errors that it shows, and its noise."""
        if kind == events.POSE:
            angle = rotation_error(_quat(self.belief.quat_xyzw), _quat(_unit(value[3:])))
            return np.concatenate((value[:3] - self.belief.position, angle)), _POSE_ROWS, self._pose_noise
        quat, noise = value
        angle = rotation_error(_quat(self.belief.quat_xyzw), _quat(_unit(quat)))
        return np.asarray(angle), _TURN_ROWS, noise

    def _inject(self) -> None:
        """Move the errors that were found into the belief (Solà eq. 282 to 286)."""
        error, now = self.x, self.belief
        turned = product(_quat(now.quat_xyzw), exponential(tuple(error[TURN].tolist())))
        self.belief = Belief(
            now.position + error[PLACE],
            now.velocity + error[VELOCITY],
            np.asarray(normalised(turned)),
            now.force_bias + error[FORCE_BIAS],
            now.rate_bias + error[RATE_BIAS] if now.measured else now.rate_bias,
            now.rate - error[RATE_BIAS],
            now.measured,
        )
        G = _SAME.copy()
        G[TURN, TURN] -= _skew(0.5 * error[TURN])
        self.P = G @ self.P @ G.T
        self.x = np.zeros(ERRORS)

    def _begin_to_measure(self) -> None:
        """Know of a turn rate only the bias of its gyroscope from now on, where none was measured before."""
        if self.belief.measured:
            return
        P = self.P.copy()
        P[RATE_BIAS], P[:, RATE_BIAS] = 0.0, 0.0
        P[RATE_BIAS, RATE_BIAS] = RATE_BIAS_STD**2 * np.eye(3)
        self.belief, self.P = self.belief._replace(measured=True), P


@lru_cache(maxsize=64)
def _steady(t: float) -> np.ndarray:
    """Derivative of a motion without force and turn in a time [s]. Not to be changed."""
    F = _SAME.copy()
    F[PLACE, VELOCITY], F[TURN, RATE_BIAS] = t * _ONE, -t * _ONE
    return F


@lru_cache(maxsize=64)
def _noise(s: SpatialMotionSettings, t: float, acceleration: float, *, measured: bool) -> np.ndarray:
    """What noise adds to the covariance in a time [s]; `measured`: by an inertial reading. Not to be changed."""
    Q, one = np.zeros((ERRORS, ERRORS)), _ONE
    q = acceleration**2
    Q[PLACE, PLACE], Q[VELOCITY, VELOCITY] = q * t**3 / 3.0 * one, q * t * one
    Q[PLACE, VELOCITY] = Q[VELOCITY, PLACE] = q * t * t / 2.0 * one
    Q[FORCE_BIAS, FORCE_BIAS] = s.accelerometer_drift**2 * t * one
    if measured:
        Q[TURN, TURN] = s.gyroscope_noise**2 * t * one
        Q[RATE_BIAS, RATE_BIAS] = s.gyroscope_drift**2 * t * one
    else:
        spin = s.spin**2
        Q[TURN, TURN], Q[RATE_BIAS, RATE_BIAS] = spin * t**3 / 3.0 * one, spin * t * one
        Q[TURN, RATE_BIAS] = Q[RATE_BIAS, TURN] = -spin * t * t / 2.0 * one
    return Q


def _axes(quat_xyzw: tuple[float, float, float, float]) -> np.ndarray:
    """The axes of a body in the world, one a row, shape (3, 3); in plain numbers, for arrays here are short."""
    return np.array([turn(quat_xyzw, axis) for axis in _AXES])


def _quat(quat_xyzw: np.ndarray) -> tuple[float, float, float, float]:
    """In plain numbers, as `_axes`."""
    x, y, z, w = quat_xyzw.tolist()
    return x, y, z, w


def _unit(quat: np.ndarray) -> np.ndarray:
    return np.asarray(quat / size_of(quat))


def _skew(v: np.ndarray) -> np.ndarray:
    """Matrix of the vector product with v."""
    x, y, z = v.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
