"""Motion in space, from poses, inertial readings and star tracker attitudes in any order of arrival.

Readings: `mocap` is a pose in the world, shape (7,): position [m], quaternion x, y, z, w. `imu` is an `ImuSample` in
the body's frame. `star_tracker` is the attitude of the body in the world, a quaternion x, y, z, w; its
covariance is about the body's axes, shape (3, 3) [rad²]. The estimate is a `RigidBodyState`; its covariance, shape
(12, 12), is about position and rotation in the world [m, rad], then velocity in the world [m/s] and turn rate in the
body [rad/s].
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fulmar_core.estimators.motion.filter import Placed
from fulmar_core.estimators.motion.history import HistoryEstimator
from fulmar_core.estimators.motion.settings import SpatialMotionSettings
from fulmar_core.estimators.motion.spatial_filter import PLACE, RATE_BIAS, TURN, VELOCITY, SpatialFilter
from fulmar_core.robots.kinds.kind import Kind
from fulmar_core.robots.robot import Limits
from fulmar_core.robots.sensors.imu import ImuSample
from fulmar_core.states.rotation import rotate, size_of
from fulmar_core.states.state import RigidBodyState
from fulmar_core.wires.reading import Reading

_ERRORS = np.arange(15)
_SHOWN = np.ix_(*2 * (np.concatenate([_ERRORS[part] for part in (PLACE, TURN, VELOCITY, RATE_BIAS)]),))


class SpatialMotionEstimator(HistoryEstimator[SpatialMotionSettings]):
    """Multiplicative extended Kalman filter with a history; see `Estimator`."""

    _filter: SpatialFilter | None

    def __init__(self, settings: SpatialMotionSettings, limits: Limits, *, kind: Kind, **others: Any) -> None:
        """Begin without an estimate; `kind` is the robot's, the rest as in `HistoryEstimator`."""
        self._kind = kind
        super().__init__(settings, limits, **others)

    def _pose(self, reading: Reading) -> np.ndarray:
        return np.array(reading.value, dtype=float)

    def _inertial(self, reading: Reading) -> ImuSample:
        sample: ImuSample = reading.value
        return sample

    def _attitude(self, reading: Reading) -> tuple[np.ndarray, np.ndarray]:
        """Quaternion, and covariance about the body's axes, shape (3, 3) [rad²]."""
        noise = reading.covariance
        return np.array(reading.value), self._settings.star_tracker_std**2 * np.eye(
            3
        ) if noise is None else noise

    def _turn_rate(self, reading: Reading) -> float:
        return size_of(reading.value.angular_velocity)

    def _new_filter(self, pose: np.ndarray) -> SpatialFilter:
        speed = 0.0 if self._kind.stays else self._limits.speed
        return SpatialFilter(self._settings, pose, weighs=self._kind.weighs, speed=speed)

    def _placed(self, pose: np.ndarray) -> Placed:
        return pose[:3], pose[3:] / size_of(pose[3:])

    def _value(self) -> tuple[RigidBodyState, np.ndarray]:
        """State, and covariance of shape (12, 12)."""
        assert self._filter is not None
        now, P = self._filter.snapshot()
        state = RigidBodyState(now.position, now.quat_xyzw, now.velocity, now.rate)
        axes = rotate(now.quat_xyzw, np.eye(3)).T  # body to world
        covariance = P[_SHOWN]
        turn = np.eye(12)
        turn[3:6, 3:6] = axes
        covariance = turn @ covariance @ turn.T
        covariance[9:, 9:] += self._settings.gyroscope_std**2 * np.eye(3)
        return state, covariance
