"""Motion in the plane, from poses, inertial readings and star tracker attitudes in any order of arrival.

Readings: `mocap` is a pose in the world, shape (7,): position [m], quaternion x, y, z, w. `imu` is an `ImuSample` in
the body's frame. `star_tracker` is the attitude of the body in the world, a quaternion x, y, z, w; its covariance is
about the body's axes, shape (3, 3) [rad²]. The estimate is a `RigidBodyState`; its covariance, shape (12, 12), is about
position and rotation in the world [m, rad], then velocity in the world [m/s] and turn rate in the body [rad/s].
"""

from __future__ import annotations

import math

import numpy as np

from fulmar_core.estimators.motion.filter import Placed
from fulmar_core.estimators.motion.history import HistoryEstimator
from fulmar_core.estimators.motion.motion_filter import (
    MOTION,
    POSE,
    RATE,
    VX,
    VY,
    YAW,
    Inertial,
    MotionFilter,
    X,
    Y,
)
from fulmar_core.estimators.motion.settings import PlanarMotionSettings
from fulmar_core.states.gravity import GRAVITY
from fulmar_core.states.rotation import from_yaw, multiply, rotate, yaw_of
from fulmar_core.states.state import RigidBodyState
from fulmar_core.wires.reading import Reading

PLANAR = np.array((0, 1, 5, 6, 7, 11))  # rows of a covariance that a motion in the plane has


class PlanarMotionEstimator(HistoryEstimator[PlanarMotionSettings]):
    """Extended Kalman filter with a history; see `Estimator`."""

    _filter: MotionFilter | None

    def _forget(self) -> None:
        super()._forget()
        self._height, self._tilt = 0.0, np.array([0.0, 0.0, 0.0, 1.0])

    def _believed(self, reading: Reading) -> None:
        """Keep what a motion in the plane leaves alone: height, roll and pitch."""
        quat = reading.value[3:] / np.linalg.norm(reading.value[3:])
        self._height, self._tilt = float(reading.value[2]), multiply(from_yaw(-yaw_of(quat)), quat)

    def _pose(self, reading: Reading) -> np.ndarray:
        """Place and heading, shape (3,) [m, m, rad]."""
        quat = reading.value[3:] / np.linalg.norm(reading.value[3:])
        return np.array([reading.value[0], reading.value[1], float(yaw_of(quat))])

    def _inertial(self, reading: Reading) -> Inertial:
        """Specific force along the level axes, without gravity, and turn rate."""
        rate = self._turn_rate(reading) if reading.value.has_rate else None
        if not reading.value.has_force:
            return None, rate
        level = rotate(self._tilt, reading.value.specific_force) - np.array([0.0, 0.0, GRAVITY])
        return level[:2], rate

    def _attitude(self, reading: Reading) -> tuple[float, float]:
        """Heading and its standard deviation [rad]."""
        std = self._settings.star_tracker_std
        if reading.covariance is not None:
            std = math.sqrt(float(reading.covariance[2, 2]))
        return float(yaw_of(reading.value)), std

    def _turn_rate(self, reading: Reading) -> float:
        return float(reading.value.angular_velocity[2])

    def _new_filter(self, pose: np.ndarray) -> MotionFilter:
        return MotionFilter(self._settings, pose)

    def _placed(self, pose: np.ndarray) -> Placed:
        return np.array([*pose[:2], 0.0]), np.asarray(from_yaw(np.asarray(pose[2])))

    def _value(self) -> tuple[RigidBodyState, np.ndarray]:
        """State, and covariance of shape (12, 12)."""
        assert self._filter is not None
        x, P = self._filter.snapshot()
        state = RigidBodyState(
            np.array([x[X], x[Y], self._height]),
            np.asarray(multiply(from_yaw(np.asarray(x[YAW])), self._tilt)),
            np.array([x[VX], x[VY], 0.0]),
            np.array([0.0, 0.0, x[RATE]]),
        )
        covariance = np.zeros((12, 12))
        covariance[np.ix_(PLANAR, PLANAR)] = P[np.ix_((*POSE, *MOTION), (*POSE, *MOTION))]
        return state, covariance
