"""What every estimator's settings have, as read from `configs/estimators`; without the filters' libraries."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, Literal


@dataclass(frozen=True, kw_only=True)
class EstimatorSettings:
    """One file of `configs/estimators`; each kind of estimator adds its own keys."""

    title: str
    bridge_s: float  # longest time without a believed reading before the estimate is stale [s]
    latency_s: float = (
        0.0  # from capture to the stamp of a pose, as measured; 0: sources stamp at capture [s]
    )

    POSITIVE: ClassVar[tuple[str, ...]] = ()  # names of entries that must be greater than 0

    def __post_init__(self) -> None:
        if not self.bridge_s > 0.0:
            raise ValueError(f"'bridge_s' = {self.bridge_s:g} must be greater than 0.")
        if not 0.0 <= self.latency_s <= 1.0:
            raise ValueError(f"'latency_s' = {self.latency_s:g} must be from 0 to 1 s.")
        for name in self.POSITIVE:
            if not getattr(self, name) > 0.0:
                raise ValueError(f"'{name}' = {getattr(self, name):g} must be greater than 0.")


@dataclass(frozen=True, kw_only=True)
class MotionSettings(EstimatorSettings, ABC):
    """What estimators of motion have in common.

    Densities are those of white noise: over a time t they spread what they drive by density · √t.
    """

    position_std: float  # of a pose, each axis [m]
    # About each axis, of an attitude whose reading states no covariance; in the plane of its heading [rad].
    star_tracker_std: float = 0.0005
    gyroscope_std: float  # of a reading [rad/s]
    acceleration_noise: float  # of the inertial unit, with what its mounting adds [m/s²/√Hz]
    manoeuvre: float  # acceleration of manoeuvres, without an inertial unit [m/s²/√Hz]
    spin: float  # how fast the turn rate may change; in space only without an inertial unit [rad/s²/√Hz]
    accelerometer_drift: float  # of its bias [m/s²/√s]
    gyroscope_drift: float  # of its bias [rad/s/√s]
    # Largest bias that a sound accelerometer may have, with what it is mounted askew [m/s²].
    accelerometer_bias: float = 0.5
    gyroscope_bias: float = 0.2  # largest bias that a sound gyroscope may have [rad/s]
    # Squared Mahalanobis distance of a pose beyond which it is an outlier; of 3 degrees of freedom, in space 6 [-].
    gate: float

    POSITIVE: ClassVar[tuple[str, ...]] = (
        "position_std", "star_tracker_std", "gyroscope_std", "acceleration_noise", "manoeuvre", "spin", "gate",
        "accelerometer_bias", "gyroscope_bias",
    )  # fmt: skip

    @property
    @abstractmethod
    def pose_turn_std(self) -> float:
        """Of the angles of a pose [rad]."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if min(self.accelerometer_drift, self.gyroscope_drift) < 0.0:
            raise ValueError("accelerometer_drift and gyroscope_drift must not be negative.")


@dataclass(frozen=True, kw_only=True)
class PlanarMotionSettings(MotionSettings):
    """Settings of `PlanarMotionEstimator`."""

    kind: str = "planar_motion"
    heading_std: float  # of a pose [rad]

    POSITIVE = (*MotionSettings.POSITIVE, "heading_std")

    @property
    def pose_turn_std(self) -> float:
        """Of the angles of a pose [rad]."""
        return self.heading_std


@dataclass(frozen=True, kw_only=True)
class SpatialMotionSettings(MotionSettings):
    """Settings of `SpatialMotionEstimator`."""

    kind: str = "spatial_motion"
    attitude_std: float  # of a pose, about each axis [rad]
    gyroscope_noise: float  # density of a gyroscope's reading [rad/s/√Hz]

    POSITIVE = (*MotionSettings.POSITIVE, "attitude_std", "gyroscope_noise")

    @property
    def pose_turn_std(self) -> float:
        """Of the angles of a pose [rad]."""
        return self.attitude_std


@dataclass(frozen=True, kw_only=True)
class AttitudeSettings(EstimatorSettings):
    """Settings of `AttitudeEstimator`. Densities are those of white noise."""

    kind: str = "attitude"
    star_tracker_std: float  # about each axis, of an attitude whose reading states no covariance [rad]
    gyroscope_std: float  # of a reading [rad/s]
    gyroscope_drift: float  # of its bias [rad/s/√s]
    wheel_std: float  # of a measured speed [rad/s]
    inertia_share: float  # standard deviation of the inertia in the robot's file, as a share of it [-]
    rate_spread: float  # of the turn rate by what its model leaves out, wheels measured [rad/s/√s]
    rate_spread_blind: float  # same without measured wheels [rad/s/√s]
    attitude_limit_deg: float  # standard deviation beyond which there is no estimate [deg]
    rate_limit_deg: float  # same of the turn rate [deg/s]

    POSITIVE: ClassVar[tuple[str, ...]] = (
        "star_tracker_std", "gyroscope_std", "rate_spread", "rate_spread_blind", "attitude_limit_deg", "rate_limit_deg",
    )  # fmt: skip

    def __post_init__(self) -> None:
        super().__post_init__()
        if min(self.gyroscope_drift, self.wheel_std, self.inertia_share) < 0.0:
            raise ValueError("gyroscope_drift, wheel_std and inertia_share must not be negative.")


@dataclass(frozen=True, kw_only=True)
class InertiaSettings(EstimatorSettings):
    """Settings of `InertiaEstimator`."""

    kind: str = "inertia"
    method: Literal["batch", "rls", "ekf"]  # least squares over all, with forgetting, or a filter
    tensor: Literal["diagonal", "full"] = "diagonal"
    every_s: float = 0.1  # time between the readings that are used, at least [s]
    gyroscope_std: float  # of a reading [rad/s]
    wheel_std: float  # of a measured speed [rad/s]
    guess: float = 1.0  # factor on the inertia of the robot's file, to begin with [-]
    spread: float = 0.3  # standard deviation of that guess, as a share [-]
    walk: float = 5e-3  # of the inertia in the filter, as a share [1/√s]
    memory_s: float = 60.0  # after which a reading counts 1/e in the least squares with forgetting [s]
    known_share: float = (
        0.02  # standard deviation of a moment, as a share, beyond which it is not published [-]
    )

    POSITIVE: ClassVar[tuple[str, ...]] = (
        "every_s", "gyroscope_std", "wheel_std", "guess", "spread", "walk", "memory_s", "known_share",
    )  # fmt: skip

    @property
    def count(self) -> int:
        """Numbers of the inertia that are estimated."""
        return 3 if self.tensor == "diagonal" else 6


@dataclass(frozen=True, kw_only=True)
class EventRateSettings(EstimatorSettings):
    """Settings of `EventRateEstimator`."""

    kind: str = "event_rate"
    window_s: float = 0.2  # length of a window [s]
    longest_s: float = 1.0  # of the window that is used where a short one shows too little [s]
    least_stars: int = 6  # in a window: fewer may agree by chance
    limit_deg: float = 0.5  # standard deviation about an axis beyond which it is not observable [deg/s]
    fastest_deg: float = 60.0  # a faster rate is a wrong one [deg/s]

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 < self.window_s <= self.longest_s or self.least_stars < 1:
            raise ValueError("0 < window_s <= longest_s and least_stars >= 1 are needed.")
        if min(self.limit_deg, self.fastest_deg) <= 0.0:
            raise ValueError("limit_deg and fastest_deg must be greater than 0.")
