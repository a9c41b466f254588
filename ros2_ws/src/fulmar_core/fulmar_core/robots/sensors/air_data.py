"""Air data: airspeed probe, vanes for the angles of attack and sideslip, and a height above the ground."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from fulmar_core.config.plausible_ranges import Plausible
from fulmar_core.robots.sensors.kind import MessageFields, SensorKind, Truth
from fulmar_core.robots.sensors.odometer import Channel, largest_reading
from fulmar_core.robots.sensors.ranges import in_order, named_problem
from fulmar_core.robots.sensors.sampling import Sampling, sensor_rng
from fulmar_core.states.rotation import rotate
from fulmar_core.wires.reading import Reading
from fulmar_core.wires.wire import Wire

NAME = "air_data"
# What probes can report whose file states no limit: below the speed of sound; a whole turn; the stratosphere.
MOST = {"airspeed": 340.0, "alpha": math.pi, "beta": math.pi, "height": 5e4}  # m/s, rad, rad, m


@dataclass(frozen=True)
class AirDataSpec:
    """What is measured of the air, and when; angles only where there are vanes."""

    NAMES: ClassVar[tuple[str, ...]] = ("airspeed", "alpha", "beta", "height")

    airspeed: Channel = Channel()  # of a pitot tube [m/s]
    alpha: Channel = Channel()  # angle of attack, of a vane [rad]
    beta: Channel = Channel()  # sideslip, of a vane [rad]
    height: Channel = Channel()  # above the ground, of a radar or sonar altimeter [m]
    vanes: bool = True  # False: neither angle is reported
    rate_hz: float = 0.0  # of measurements; 0: one with each sample of the plant [Hz]
    delay_s: float = 0.0  # from measurement to message; the stamp is that of the measurement [s]

    def __post_init__(self) -> None:
        if min(self.rate_hz, self.delay_s) < 0.0:
            raise ValueError("rate_hz and delay_s must not be negative.")

    @property
    def names(self) -> tuple[str, ...]:
        """What is reported."""
        return (
            self.NAMES if self.vanes else tuple(name for name in self.NAMES if name not in ("alpha", "beta"))
        )

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Of what is reported."""
        return tuple(getattr(self, name) for name in self.names)


@dataclass(frozen=True, slots=True)
class AirData:
    """What is known of the air that one aircraft meets."""

    names: tuple[str, ...]  # of `AirDataSpec.NAMES`
    values: np.ndarray  # shape (n,) [m/s], [rad] and [m]


class AirProbes:
    """The probes of one simulated aircraft; biases and errors of scale stay for an episode."""

    def __init__(self, spec: AirDataSpec, noisy: bool) -> None:
        """Prepare; without noise every reading is the truth, at once."""
        self._spec, self._noisy = spec, noisy
        self._sampling = Sampling(spec.rate_hz, spec.delay_s if noisy else 0.0)
        channels = spec.channels
        self._std, self._bias_std, self._scale_std, limit, self._quantum = (
            np.array([getattr(channel, part) for channel in channels])
            for part in ("std", "bias_std", "scale_std", "limit", "quantum")
        )
        self._most = largest_reading(limit, self._quantum)
        self._step = np.where(self._quantum > 0.0, self._quantum, 1.0)
        self._steps = bool((self._quantum > 0.0).any())
        self._spread = np.diag(self._std**2 + self._quantum**2 / 12.0)

    def reset(self, seed: int, number: int) -> None:
        """Begin an episode; see `SimulatedSensor`."""
        self._rng = sensor_rng(seed, number, NAME)
        self._bias = self._bias_std * self._rng.standard_normal(len(self._std))
        self._scale = 1.0 + self._scale_std * self._rng.standard_normal(len(self._std))
        self._sampling.reset()

    def measure(self, truth: Truth, time_s: float) -> Reading | None:
        """`AirData` with the variances of its parts; None between two measurements, or where the air is not known."""
        air = truth.more.get(NAME)
        if air is None:
            return None
        if self._sampling.is_due(time_s):
            every = dict(zip(air.names, air.values.tolist(), strict=True))
            values = np.array([every[name] for name in self._spec.names])
            if self._noisy:
                noise = self._std * self._rng.standard_normal(len(values))
                values = (values * self._scale + self._bias + noise).clip(-self._most, self._most)
                if self._steps:
                    whole = np.round(values / self._step) * self._step
                    values = np.where(self._quantum > 0.0, whole, values)
            self._sampling.put(Reading(AirData(self._spec.names, values), covariance=self._spread), time_s)
        return self._sampling.take(time_s)


def wind_of(quat_xyzw: np.ndarray, velocity: np.ndarray, air: np.ndarray) -> np.ndarray:
    """The wind that an aircraft meets: its velocity over the ground without that through the air.

    Args:
        quat_xyzw: Attitude, body to world, shape (..., 4).
        velocity: Of the aircraft over the ground, along the world's axes, shape (..., 3) [m/s].
        air: Airspeed [m/s], angle of attack and sideslip [rad], as `Inputs.readings` has them, shape (..., 3 or more).

    Returns:
        Along the world's axes, where the wind blows to, shape (..., 3) [m/s].
    """
    speed, alpha, beta = air[..., 0], air[..., 1], air[..., 2]
    ahead, right, down = np.cos(alpha) * np.cos(beta), np.sin(beta), np.sin(alpha) * np.cos(beta)
    through = speed[..., None] * np.stack((ahead, -right, -down), axis=-1)  # ahead, left, up
    return np.asarray(velocity - rotate(quat_xyzw, through))


def _write(reading: Reading, _spec: AirDataSpec) -> list[Any]:
    return [list(reading.value.names), reading.value.values.tolist()]


def _read(values: Sequence[Any]) -> Reading:
    names, numbers = values
    return Reading(AirData(tuple(names), np.array(numbers, dtype=float)))


def _problem(reading: Reading, robot: Any) -> str:
    spec = robot.sensors.specs.get(NAME, AirDataSpec())
    largest = {
        name: channel.limit or MOST[name] for name, channel in zip(spec.names, spec.channels, strict=True)
    }
    return named_problem("probe", reading.value.names, reading.value.values, largest)


KIND = SensorKind(
    spec=AirDataSpec,
    wire=Wire(
        "air_data", "sensor_msgs/msg/JointState", "plant", "stream", "`rate_hz` of the probes, else each tick",
        "`airspeed`, `alpha`, `beta` and `height` of an aircraft, in `position` by name", unit="m/s, rad, m",
    ),
    frame="base_link",
    message=MessageFields(paths=("name", "position"), write=_write, read=_read),
    simulate=AirProbes,
    problem=_problem,
    numbers=lambda reading, robot: in_order(reading.value.names, reading.value.values, robot.sensors.specs[NAME].names),
    plausible=(
        Plausible("airspeed.std", "m/s", (0.0, 20.0), (0.0, 3.0), "pitot tubes"),
        Plausible("alpha.std", "rad", (0.0, 0.5), (0.0, 0.1), "vanes"),
        Plausible("beta.std", "rad", (0.0, 0.5), (0.0, 0.1), "vanes"),
        Plausible("height.std", "m", (0.0, 50.0), (0.0, 5.0), "altimeters"),
        Plausible("rate_hz", "Hz", (0.05, 1e4), (0.5, 1000.0), "air data computers"),
    ),
)  # fmt: skip
