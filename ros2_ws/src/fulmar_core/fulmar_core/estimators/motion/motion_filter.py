"""Planar motion as an extended Kalman filter: nine states, moved on by an inertial unit, corrected by poses.

filterpy does the filtering; here are the model and its derivatives. The accelerometer drives the velocities as an
input (Solà, "Quaternion kinematics for the error-state Kalman filter", arXiv 1711.02508, section 5, in the plane),
the gyroscope measures the turn rate.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fulmar_core.estimators.motion import filter as events
from fulmar_core.estimators.motion.filter import Filter, Placed
from fulmar_core.estimators.motion.kalman import LeanKalmanFilter
from fulmar_core.estimators.motion.settings import PlanarMotionSettings
from fulmar_core.states.rotation import from_yaw

STATES = 9
X, Y, YAW, VX, VY, RATE, BIAS_X, BIAS_Y, BIAS_RATE = range(STATES)
POSE, MOTION = [X, Y, YAW], [VX, VY, RATE]
BIASES = [BIAS_X, BIAS_Y, BIAS_RATE]
COMPARED = [X, Y, VX, VY, YAW]
SPREAD_AT_START = (1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.05, 0.05, 0.02)  # m, rad, m/s, rad/s, m/s², rad/s
_POSE_ROWS, _GYRO_ROW = np.eye(STATES)[POSE], np.eye(STATES)[[RATE]] + np.eye(STATES)[[BIAS_RATE]]

Snapshot = tuple[np.ndarray, np.ndarray]
# Specific force along the body's level axes, shape (2,) [m/s²], and turn rate [rad/s]; None: not measured.
Inertial = tuple[np.ndarray | None, float | None]


class MotionFilter(LeanKalmanFilter, Filter):
    """Position, heading, velocity and turn rate, with the biases of the inertial unit.

    `x` holds (x, y) [m], yaw [rad], (v_x, v_y) in the world [m/s], turn rate [rad/s], then the biases of the
    accelerometer along the body's axes [m/s²] and of the gyroscope [rad/s]. Events: a pose (x, y, yaw), shape (3,); an
    inertial reading, see `Inertial`; of an attitude its yaw with its standard deviation [rad].
    """

    def __init__(self, settings: PlanarMotionSettings, pose: np.ndarray) -> None:
        """Begin at rest at a pose (x [m], y [m], yaw [rad]), knowing little else."""
        super().__init__(dim_x=STATES, dim_z=3)
        self._settings = settings
        self.x = np.zeros(STATES)
        self.x[POSE] = pose
        spread = np.array(SPREAD_AT_START)
        spread[POSE] = settings.position_std, settings.position_std, settings.heading_std
        self.P = np.diag(spread**2)
        self._pose_noise = np.diag(spread[POSE] ** 2)
        self._gyro_noise = np.array([[settings.gyroscope_std**2]])

    def move_on(self, seconds: float, inertial: Inertial | None) -> None:
        """Predict by the specific force of a reading; see `Filter.move_on`."""
        if seconds <= 0.0:
            return
        force = None if inertial is None else inertial[0]
        s, t = self._settings, seconds
        self._prepare(t, force, s.manoeuvre if force is None else s.acceleration_noise)
        self.predict(u=(t, force))

    def predict_x(self, u: Any = 0) -> None:
        """Move the state on, exactly for an acceleration that stays the same in the world; see `move_on`."""
        t, force = u
        a = self._acceleration(force)
        self.x = self.x.copy()
        self.x[[X, Y]] += t * self.x[[VX, VY]] + 0.5 * t * t * a
        self.x[[VX, VY]] += t * a
        self.x[YAW] += t * self.x[RATE]

    def correct(self, kind: int, value: Any) -> None:
        """Correct by an event; see `Filter.correct`."""
        if kind == events.POSE:
            self.update(
                value, lambda _x: _POSE_ROWS, lambda x: x[POSE], R=self._pose_noise, residual=self._pose_error
            )
        elif kind == events.IMU:
            if value[1] is None:
                return
            self.update(
                np.array([value[1]]),
                lambda _x: _GYRO_ROW,
                lambda x: np.array([x[RATE] + x[BIAS_RATE]]),
                R=self._gyro_noise,
            )
        else:
            yaw, std = value
            error = math.remainder(yaw - float(self.x[YAW]), 2.0 * math.pi)
            self.update(
                np.array([float(self.x[YAW]) + error]),
                lambda _x: _POSE_ROWS[2:],
                lambda x: np.array([x[YAW]]),
                R=np.array([[std**2]]),
            )

    def distance2(self, kind: int, value: Any) -> float:
        """Of a pose or of a heading; see `Filter.distance2`."""
        if kind == events.POSE:
            y = self._pose_error(value, self.x[POSE])
            spread = self.P[np.ix_(POSE, POSE)] + self._pose_noise
            return float(y @ np.linalg.solve(spread, y))
        yaw, std = value
        error = math.remainder(yaw - float(self.x[YAW]), 2.0 * math.pi)
        return float(error**2 / (self.P[YAW, YAW] + std**2))

    def speed_std(self) -> float:
        """See `Filter.speed_std`."""
        return math.sqrt(max(self.P[VX, VX], self.P[VY, VY]))

    def rate_std(self) -> float:
        """See `Filter.rate_std`."""
        return math.sqrt(self.P[RATE, RATE])

    def placed(self) -> Placed:
        """See `Filter.placed`."""
        return np.array([self.x[X], self.x[Y], 0.0]), np.asarray(from_yaw(np.asarray(self.x[YAW])))

    def biases(self) -> tuple[float, float]:
        """See `Filter.biases`."""
        return math.hypot(self.x[BIAS_X], self.x[BIAS_Y]), abs(float(self.x[BIAS_RATE]))

    def keep_biases(self, other: MotionFilter) -> None:
        """See `Filter.keep_biases`."""
        x, P = self.x.copy(), self.P.copy()
        x[BIASES], P[np.ix_(BIASES, BIASES)] = other.x[BIASES], other.P[np.ix_(BIASES, BIASES)]
        self.x, self.P = x, P

    def velocity(self) -> np.ndarray:
        """See `Filter.velocity`."""
        return np.asarray(self.x[[VX, VY]])

    def turn_rate(self) -> float:
        """See `Filter.turn_rate`."""
        return abs(float(self.x[RATE]))

    def separation(self, other: MotionFilter) -> tuple[np.ndarray, np.ndarray]:
        """See `Filter.separation`."""
        error = self._pose_error(self.x.copy(), other.x)
        return error[COMPARED], other.P[np.ix_(COMPARED, COMPARED)]

    def snapshot(self) -> Snapshot:
        """State and covariance, to go back to."""
        return self.x, self.P  # filterpy replaces both, and changes neither in place

    def restore(self, snapshot: Snapshot) -> None:
        """Go back."""
        self.x, self.P = snapshot

    def _acceleration(self, force: np.ndarray | None) -> np.ndarray:
        """In the world, shape (2,) [m/s²]."""
        if force is None:
            return np.zeros(2)
        ahead, left = force[0] - self.x[BIAS_X], force[1] - self.x[BIAS_Y]
        c, s = math.cos(self.x[YAW]), math.sin(self.x[YAW])
        return np.array([c * ahead - s * left, s * ahead + c * left])

    def _prepare(self, t: float, force: np.ndarray | None, acceleration_noise: float) -> None:
        """Derivative of the motion, and what noise adds to it."""
        F = np.eye(STATES)
        F[X, VX] = F[Y, VY] = F[YAW, RATE] = t
        half = 0.5 * t * t
        if force is not None:
            ax, ay = self._acceleration(force)
            c, s = math.cos(self.x[YAW]), math.sin(self.x[YAW])
            for row, gain in (([X, Y], half), ([VX, VY], t)):
                F[row, YAW] = gain * np.array([-ay, ax])
                F[row, BIAS_X] = -gain * np.array([c, s])
                F[row, BIAS_Y] = -gain * np.array([-s, c])
        self.F = F
        Q = np.zeros((STATES, STATES))
        speeds = ((X, VX, acceleration_noise), (Y, VY, acceleration_noise), (YAW, RATE, self._settings.spin))
        for place, speed, density in speeds:
            q = density**2
            Q[place, place], Q[speed, speed] = q * t**3 / 3.0, q * t
            Q[place, speed] = Q[speed, place] = q * t * t / 2.0
        Q[BIAS_X, BIAS_X] = Q[BIAS_Y, BIAS_Y] = self._settings.accelerometer_drift**2 * t
        Q[BIAS_RATE, BIAS_RATE] = self._settings.gyroscope_drift**2 * t
        self.Q = Q

    @staticmethod
    def _pose_error(measured: np.ndarray, expected: np.ndarray) -> np.ndarray:
        error: np.ndarray = measured - expected
        error[2] = math.remainder(error[2], 2.0 * math.pi)
        return error
