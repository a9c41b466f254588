"""Tachometers of reaction wheels: speed of each wheel relative to the body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.plausible_ranges import Plausible
from fulmar_core.sensors.kind import MessageFields, SensorKind, Truth
from fulmar_core.sensors.reading import Reading
from fulmar_core.sensors.sampling import Sampling, sensor_rng
from fulmar_core.wire import Wire

NAME = "wheels"


@dataclass(frozen=True)
class WheelsSpec:
    """What the tachometers report, and when."""

    std: float = 0.0  # white noise of each speed [rad/s]
    quantum: float = 0.0  # speeds are whole multiples of this; 0: any [rad/s]
    rate_hz: float = 0.0  # of measurements; 0: one with each sample of the plant [Hz]

    def __post_init__(self) -> None:
        if min(self.std, self.quantum, self.rate_hz) < 0.0:
            raise ValueError("std, quantum and rate_hz must not be negative.")


@dataclass(frozen=True, slots=True)
class WheelSpeeds:
    """Speeds of the wheels of one robot relative to its body."""

    names: tuple[str, ...]  # of the wheels
    speeds: np.ndarray  # shape (n,) [rad/s]


class Tachometers:
    """The tachometers of one simulated robot."""

    def __init__(self, spec: WheelsSpec, noisy: bool) -> None:
        """Prepare; without noise every reading is the truth."""
        self._spec, self._noisy = spec, noisy
        self._sampling = Sampling(spec.rate_hz, 0.0)

    def reset(self, seed: int, number: int) -> None:
        """Begin an episode; see `SimulatedSensor`."""
        self._rng = sensor_rng(seed, number, NAME)
        self._sampling.reset()

    def measure(self, truth: Truth, time_s: float) -> Reading | None:
        """`WheelSpeeds`, with their covariance of shape (n, n); None between two measurements or without wheels."""
        if truth.wheels is None or not self._sampling.is_due(time_s):
            return None
        spec, true = self._spec, truth.wheels
        speeds = np.array(true.speeds, dtype=float)
        if self._noisy:
            speeds = speeds + spec.std * self._rng.standard_normal(len(speeds))
            if spec.quantum:
                speeds = np.round(speeds / spec.quantum) * spec.quantum
        spread = spec.std**2 + spec.quantum**2 / 12.0
        return Reading(WheelSpeeds(true.names, speeds), covariance=spread * np.eye(len(speeds)))


def _write(reading: Reading, _spec: WheelsSpec) -> list[Any]:
    return [list(reading.value.names), reading.value.speeds.tolist()]


def _read(values: Sequence[Any]) -> Reading:
    names, speeds = values
    return Reading(WheelSpeeds(tuple(names), np.array(speeds, dtype=float)))


KIND = SensorKind(
    spec=WheelsSpec,
    wire=Wire(
        "wheels/state", "sensor_msgs/msg/JointState", "plant", "stream", "`rate_hz` of the tachometers, else each tick",
        "speed of each reaction wheel relative to the body; `velocity` by wheel name", unit="rad/s",
    ),
    frame="base_link",
    message=MessageFields(paths=("name", "velocity"), write=_write, read=_read),
    simulate=Tachometers,
    plausible=(
        Plausible("std", "rad/s", (0.0, 100.0), (0.0, 2.0), "tachometers: a thousandth of the speed"),
        Plausible("rate_hz", "Hz", (0.05, 1e4), (0.5, 1000.0), "wheel electronics"),
    ),
)  # fmt: skip
