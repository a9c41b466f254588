"""Star tracker: attitude of the body among the stars, at a low rate.

It sees where its boresight points far better than how it is turned about it. A mounting error stays for an episode.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fulmar_core.config.plausible_ranges import Plausible
from fulmar_core.robots.sensors.kind import MessageFields, SensorKind, Truth
from fulmar_core.robots.sensors.ranges import attitude_problem, covariance_problem
from fulmar_core.robots.sensors.sampling import Sampling, sensor_rng
from fulmar_core.states.rotation import multiply
from fulmar_core.wires.reading import Reading
from fulmar_core.wires.wire import Wire

NAME = "star_tracker"
Vector3 = tuple[float, float, float]


@dataclass(frozen=True)
class StarTrackerSpec:
    """What a star tracker reports, and when."""

    std: float = 0.0  # about each axis across the boresight [rad]
    boresight_std: float = 0.0  # about the boresight; of real ones 3 to 10 times `std` [rad]
    boresight: Vector3 = (0.0, 0.0, 1.0)  # where it looks, in the body
    bias_std: float = 0.0  # of the mounting, about each axis of the body, for an episode [rad]
    rate_hz: float = 0.0  # of measurements; 0: one with each sample of the plant [Hz]
    delay_s: float = 0.0  # from measurement to message; the stamp is that of the measurement [s]
    dropout: float = 0.0  # share of measurements that are lost [-]

    def __post_init__(self) -> None:
        if min(self.std, self.boresight_std, self.bias_std, self.rate_hz, self.delay_s) < 0.0:
            raise ValueError("std, boresight_std, bias_std, rate_hz and delay_s must not be negative.")
        if not 0.0 <= self.dropout < 1.0:
            raise ValueError(f"'dropout' = {self.dropout:g} must lie in [0, 1).")
        if math.hypot(*self.boresight) < 1e-6:
            raise ValueError(
                f"'boresight' = {list(self.boresight)} is no direction. Example: [0, 0, 1] for up."
            )

    @property
    def error(self) -> np.ndarray:
        """Matrix that makes three standard normal numbers a rotation vector of the error in the body, (3, 3) [rad]."""
        axis = np.array(self.boresight) / math.hypot(*self.boresight)
        along = np.outer(axis, axis)
        return self.std * (np.eye(3) - along) + self.boresight_std * along


class StarTracker:
    """The star tracker of one simulated robot. The world of the simulation counts as inertial."""

    def __init__(self, spec: StarTrackerSpec, noisy: bool) -> None:
        """Prepare; without noise its readings are exact, none is lost, and none is late."""
        if not noisy:
            spec = replace(spec, std=0.0, boresight_std=0.0, bias_std=0.0, delay_s=0.0, dropout=0.0)
        self._spec, self._error = spec, spec.error
        self._covariance = self._error @ self._error.T
        self._sampling = Sampling(spec.rate_hz, spec.delay_s)

    def reset(self, seed: int, number: int) -> None:
        """Begin an episode with a mounting error of its own; see `SimulatedSensor`."""
        self._rng = sensor_rng(seed, number, NAME)
        self._bias = self._spec.bias_std * self._rng.standard_normal(3)
        self._sampling.reset()

    def measure(self, truth: Truth, time_s: float) -> Reading | None:
        """See `SimulatedSensor.measure`.

        The value is the attitude as a unit quaternion xyzw, shape (4,); its covariance is that of a small rotation
        about the axes of the body, shape (3, 3) [rad²], without the mounting error.
        """
        if self._sampling.is_due(time_s):
            lost = self._rng.random() < self._spec.dropout
            error = self._bias + self._error @ self._rng.standard_normal(3)
            if not lost:
                attitude = multiply(np.asarray(truth.state.quat_xyzw, dtype=float), _rotation(error))
                attitude /= np.linalg.norm(attitude)
                self._sampling.put(Reading(attitude, covariance=self._covariance), time_s)
        return self._sampling.take(time_s)


def _rotation(vector: np.ndarray) -> np.ndarray:
    """Quaternion xyzw of a rotation vector, shape (3,) [rad] to (4,); Solà, equation 101."""
    angle = float(np.linalg.norm(vector))
    share = 0.5 * np.sinc(0.5 * angle / np.pi)  # sin(angle / 2) / angle
    return np.append(share * vector, np.cos(0.5 * angle))


def _write(reading: Reading, _spec: StarTrackerSpec) -> list[float]:
    attitude = np.asarray(reading.value, dtype=float)
    if attitude.shape != (4,) or not abs(float(np.linalg.norm(attitude)) - 1.0) < 1e-3:
        raise ValueError(f"{attitude.tolist()} must be a unit quaternion x, y, z, w")
    return list(attitude.tolist())


def _problem(reading: Reading, _robot: Any) -> str:
    problem = attitude_problem(reading.value) or covariance_problem(reading.covariance)
    return problem and f"the star tracker's reading is refused: {problem}"


KIND = SensorKind(
    spec=StarTrackerSpec,
    wire=Wire(
        "attitude", "geometry_msgs/msg/QuaternionStamped", "plant", "stream",
        "`rate_hz` of the robot's star tracker, where there is one",
        "attitude by the star tracker, inertial → `base_link`, stamped at measurement", frame="`inertial`",
    ),
    frame="inertial",
    message=MessageFields(
        paths=("quaternion.x", "quaternion.y", "quaternion.z", "quaternion.w"),
        write=_write,
        read=lambda values: Reading(np.array(values, dtype=float)),
    ),
    simulate=StarTracker,
    problem=_problem,
    plausible=(
        *(
            Plausible(key, "rad", (0.0, 0.2), (0.0, 0.01), "data sheets: 1 to 200 arcseconds; one is 4.85e-6 rad")
            for key in ("std", "boresight_std", "bias_std")
        ),
        Plausible("rate_hz", "Hz", (1e-3, 1e3), (0.05, 100.0), "data sheets: 0.5 to 10 Hz, some 50 Hz"),
        Plausible("delay_s", "s", (0.0, 10.0), (0.0, 2.0), "data sheets: exposure and processing"),
    ),
)  # fmt: skip
