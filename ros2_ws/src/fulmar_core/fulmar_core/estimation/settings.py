"""What an estimator assumes of its sensors, as read from `configs/estimators`; without the filter's libraries."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from fulmar_core.config import load_config
from fulmar_core.paths import config_path


@dataclass(frozen=True)
class EstimatorSettings:
    """One file of `configs/estimators`.

    Densities are those of white noise: over a time t they spread what they drive by density · √t.
    """

    title: str
    latency_s: float  # from capture to the stamp of a pose, as measured; 0 where sources stamp at capture [s]
    position_std: float  # of a pose, each axis [m]
    heading_std: float  # of a pose [rad]
    gyroscope_std: float  # of a reading [rad/s]
    acceleration_noise: float  # of the inertial unit, with what its mounting adds [m/s²/√Hz]
    manoeuvre: float  # acceleration that nobody measures, where there is no inertial unit [m/s²/√Hz]
    spin: float  # how fast the turn rate may change [rad/s²/√Hz]
    accelerometer_drift: float  # of its bias [m/s²/√s]
    gyroscope_drift: float  # of its bias [rad/s/√s]
    gate: float  # squared Mahalanobis distance of a pose beyond which it is an outlier; 3 degrees of freedom [-]
    bridge_s: float  # longest time without a believed pose before the estimate is stale [s]

    def __post_init__(self) -> None:
        positive = ("position_std", "heading_std", "gyroscope_std", "acceleration_noise", "manoeuvre", "spin")
        for name in (*positive, "gate", "bridge_s"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"'{name}' = {getattr(self, name):g} must be greater than 0.")
        if min(self.accelerometer_drift, self.gyroscope_drift) < 0.0:
            raise ValueError("accelerometer_drift and gyroscope_drift must not be negative.")
        if not 0.0 <= self.latency_s <= 1.0:
            raise ValueError(f"'latency_s' = {self.latency_s:g} must be from 0 to 1 s.")


def load_estimator(name: str) -> EstimatorSettings:
    """Read `configs/estimators/<name>.yaml`, or the file itself where the name ends in `.yaml`.

    Raises:
        ConfigError: Unknown name, or a mistake in the file.
    """
    path = Path(name) if name.endswith(".yaml") else config_path("estimators", name)
    return load_config(EstimatorSettings, path)
