"""Specific force and turn rate as an inertial unit reports them (REP-145: +g at rest)."""

from __future__ import annotations

import functools
import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.robots.sensors.kind import MessageFields, SensorKind, Truth
from fulmar_core.robots.sensors.odometer import Channel, largest_reading
from fulmar_core.robots.sensors.ranges import size_problem
from fulmar_core.states.counter_rng import NOISE
from fulmar_core.wires.reading import Reading
from fulmar_core.wires.wire import Wire

INERTIAL = 4  # stream of the unit's random numbers, beside that of the odometry
UNKNOWN = -1.0  # REP-145: first covariance entry of a field that is absent
# What no inertial unit reports: 200 g, and 20,000 °/s [m/s², rad/s]. Where a gyroscope's own range ends, estimators
# need the reading: the body may turn faster.
MOST_FORCE, MOST_RATE = 2000.0, 350.0
OVERRANGE = 1.05  # specific force by the limit of the robot's file that its unit can report [-]
NO_GYROSCOPE = "the inertial unit reports no turn rate: it has no gyroscope"


@dataclass(frozen=True)
class Gyroscope(Channel):
    """How a measured turn rate differs from the true one."""

    walk: float = 0.0  # of the bias: its spread after a second, growing with the root of time [rad/s/√s]

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.walk < 0.0:
            raise ValueError("'walk' must not be negative.")


@dataclass(frozen=True)
class ImuSpec:
    """What an inertial unit reports, and when."""

    accelerometer: Channel = Channel()  # each axis [m/s²]
    gyroscope: Gyroscope = Gyroscope()  # each axis [rad/s]
    rate_hz: float = 0.0  # new readings; 0: with every one asked for [Hz]
    delay_s: float = 0.0  # from motion to reading [s]
    dies_s: float | None = None  # time in an episode from which on it reports nothing; None: it lives on [s]

    def __post_init__(self) -> None:
        if min(self.rate_hz, self.delay_s, self.dies_s or 0.0) < 0.0:
            raise ValueError("rate_hz, delay_s and dies_s must not be negative.")

    @property
    def gyroscope_range(self) -> float:
        """Largest turn rate about an axis that is reported; infinite without a limit [rad/s]."""
        gyroscope = self.gyroscope
        return float(largest_reading(np.array(gyroscope.limit), np.array(gyroscope.quantum)))

    def part(self, name: str) -> np.ndarray:
        """One number of the channels, for three axes of force and three of turning, shape (6,)."""
        return np.repeat([getattr(self.accelerometer, name), getattr(self.gyroscope, name)], 3)


@dataclass(frozen=True, slots=True)
class ImuSample:
    """One reading, in the frame of the unit."""

    specific_force: np.ndarray  # (3,) acceleration minus gravity; all NaN: not measured [m/s²]
    angular_velocity: np.ndarray  # (3,); all NaN: not measured [rad/s]

    @property
    def has_force(self) -> bool:
        """Whether an accelerometer reports."""
        return _reports(self.specific_force)

    @property
    def has_rate(self) -> bool:
        """Whether a gyroscope reports."""
        return _reports(self.angular_velocity)

    @property
    def is_finite(self) -> bool:
        """Whether everything that is reported is finite."""
        return _is_finite(self.specific_force) and _is_finite(self.angular_velocity)

    @property
    def lacks(self) -> str:
        """What does not report, for people; empty if both do."""
        absent = (("accelerometer", self.has_force), ("gyroscope", self.has_rate))
        return " and ".join(name for name, there in absent if not there)


def _reports(vector: np.ndarray) -> bool:
    """Whether a vector is not all NaN; asked many times a reading, in plain numbers for a tenth of the time."""
    for each in vector.tolist():  # noqa: SIM110 - a generator takes twice as long
        if each == each:
            return True
    return False


def _is_finite(vector: np.ndarray) -> bool:
    """Whether a vector is finite, or not measured."""
    return all(map(math.isfinite, vector.tolist())) or not _reports(vector)


class InertialUnit:
    """The unit of one robot, in one episode after another."""

    def __init__(self, spec: ImuSpec) -> None:
        self._spec = spec
        self._std, limit, self._quantum = (spec.part(name) for name in ("std", "limit", "quantum"))
        self._most = largest_reading(limit, self._quantum)
        self._step = np.where(self._quantum > 0.0, self._quantum, 1.0)

    def reset(self, seed: int, number: int) -> None:
        """Begin episode `number` of a seed: each has a bias and a scale error of its own."""
        self._rng = np.random.default_rng((seed, number, NOISE, INERTIAL))
        self._bias = self._spec.part("bias_std") * self._rng.standard_normal(6)
        self._scale = 1.0 + self._spec.part("scale_std") * self._rng.standard_normal(6)
        self._readings: deque[tuple[float, np.ndarray]] = deque()  # when, and what; oldest first
        self._next_s = self._walked_s = 0.0

    def measure(self, truth: ImuSample, time_s: float) -> ImuSample:
        """What the unit reports.

        Args:
            truth: Noise-free reading.
            time_s: Time in the episode, never less than before [s].

        Returns:
            Newest reading that has come through by now; at the start of an episode the first one.
        """
        tiny = 1e-9
        if time_s > self._next_s - tiny or not self._readings:
            self._walk(time_s)
            self._readings.append((time_s, self._read(truth)))
            if self._spec.rate_hz:
                self._next_s = (np.floor(time_s * self._spec.rate_hz + tiny) + 1.0) / self._spec.rate_hz
        while len(self._readings) > 1 and self._readings[1][0] <= time_s - self._spec.delay_s + tiny:
            self._readings.popleft()
        reading = self._readings[0][1]
        return ImuSample(reading[:3].copy(), reading[3:].copy())

    def _walk(self, time_s: float) -> None:
        """Let the gyroscope's bias walk until a time [s]."""
        walk = self._spec.gyroscope.walk
        if walk and time_s > self._walked_s:
            spread = walk * math.sqrt(time_s - self._walked_s)
            self._bias[3:] += spread * self._rng.standard_normal(3)
        self._walked_s = time_s

    def _read(self, truth: ImuSample) -> np.ndarray:
        reading = np.concatenate((truth.specific_force, truth.angular_velocity))
        reading = reading * self._scale + self._bias + self._std * self._rng.standard_normal(6)
        reading = reading.clip(-self._most, self._most)
        return np.where(self._quantum > 0.0, (reading / self._step).round() * self._step, reading)


class SimulatedImu:
    """The unit of one simulated robot, whose reading of the true motion is that of its body's origin."""

    def __init__(self, spec: ImuSpec, noisy: bool) -> None:
        """Prepare; without noise every reading is the truth."""
        self._unit = InertialUnit(spec) if noisy else None
        self._dies_s = math.inf if spec.dies_s is None else spec.dies_s

    def reset(self, seed: int, number: int) -> None:
        """Begin an episode; see `SimulatedSensor`."""
        if self._unit is not None:
            self._unit.reset(seed, number)

    def measure(self, truth: Truth, time_s: float) -> Reading | None:
        """An `ImuSample`, repeated until there is a newer one; None from a dead unit, or without a specific force."""
        if truth.specific_force is None or time_s >= self._dies_s:
            return None
        sample = ImuSample(truth.specific_force, truth.state.angular_velocity_in_body)
        return Reading(sample if self._unit is None else self._unit.measure(sample, time_s))


PATHS = (
    *(f"{vector}.{axis}" for vector in ("linear_acceleration", "angular_velocity") for axis in "xyz"),
    "orientation_covariance",
    "linear_acceleration_covariance",
    "angular_velocity_covariance",
)


@functools.cache
def _covariances(spec: ImuSpec, has_force: bool, has_rate: bool) -> tuple[tuple[float, ...], ...]:
    """Of orientation, specific force and turn rate, nine numbers each; absent ones are marked as REP-145 says."""
    force = np.eye(3).ravel() * spec.accelerometer.std**2
    turn = np.eye(3).ravel() * spec.gyroscope.std**2
    absent = np.zeros(9)
    absent[0] = UNKNOWN
    if not has_force:
        force[0] = UNKNOWN
    if not has_rate:
        turn[0] = UNKNOWN
    return tuple(absent.tolist()), tuple(force.tolist()), tuple(turn.tolist())


def _write(reading: Reading, spec: ImuSpec) -> Sequence[Any]:
    sample: ImuSample = reading.value
    absent = (0.0, 0.0, 0.0)
    return (
        *(sample.specific_force.tolist() if sample.has_force else absent),
        *(sample.angular_velocity.tolist() if sample.has_rate else absent),
        *_covariances(spec, sample.has_force, sample.has_rate),
    )


def _read(values: Sequence[Any]) -> Reading:
    force, turn = np.array(values[:3], dtype=float), np.array(values[3:6], dtype=float)
    for vector, name in ((force, "linear_acceleration_covariance"), (turn, "angular_velocity_covariance")):
        if values[PATHS.index(name)][0] == UNKNOWN:
            vector[:] = np.nan
    return Reading(ImuSample(force, turn))


def _problem(reading: Reading, robot: Any) -> str:
    sample, spec = reading.value, robot.sensors.imu
    if not sample.is_finite:
        return "the inertial reading holds a value that is not finite"
    if not (sample.has_force or sample.has_rate):
        return "the inertial reading has neither a specific force nor a turn rate"
    parts = []
    if sample.has_force:
        most = OVERRANGE * spec.accelerometer.limit or MOST_FORCE
        parts += [("the accelerometer", each, most) for each in sample.specific_force.tolist()]
    if sample.has_rate:
        parts += [("the gyroscope", each, MOST_RATE) for each in sample.angular_velocity.tolist()]
    return size_problem(parts)


KIND = SensorKind(
    spec=ImuSpec,
    wire=Wire(
        "imu/data", "sensor_msgs/msg/Imu", "plant", "stream", "every plant tick",
        "specific force (+g at rest) and turn rate; no orientation", unit="m/s², rad/s", frame="`imu_link`",
    ),
    frame="imu_link",
    message=MessageFields(PATHS, _write, _read),
    simulate=SimulatedImu,
    problem=_problem,
    numbers=lambda reading, _robot: np.concatenate((reading.value.specific_force, reading.value.angular_velocity)),
)  # fmt: skip
