"""Sensors of an aircraft's servos and motors: where each surface stands, and how far each motor is open."""

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

NAME = "surfaces"


@dataclass(frozen=True)
class SurfacesSpec:
    """What the servos report, and when; levels of motors are reported without errors."""

    std: float = 0.0  # white noise of each deflection [rad]
    quantum: float = 0.0  # deflections are whole multiples of this; 0: any [rad]
    rate_hz: float = 0.0  # of measurements; 0: one with each sample of the plant [Hz]

    def __post_init__(self) -> None:
        if min(self.std, self.quantum, self.rate_hz) < 0.0:
            raise ValueError("std, quantum and rate_hz must not be negative.")


@dataclass(frozen=True, slots=True)
class SurfacePositions:
    """Where the surfaces and motors of one aircraft stand."""

    names: tuple[str, ...]  # of the actuators: surfaces, then throttles
    positions: np.ndarray  # shape (n,): deflections [rad], then thrust levels from 0 to 1


class ServoSensors:
    """The sensors of one simulated aircraft."""

    def __init__(self, spec: SurfacesSpec, noisy: bool) -> None:
        """Prepare; without noise every reading is the truth."""
        self._spec, self._noisy = spec, noisy
        self._sampling = Sampling(spec.rate_hz, 0.0)

    def reset(self, seed: int, number: int) -> None:
        """Begin an episode; see `SimulatedSensor`."""
        self._rng = sensor_rng(seed, number, NAME)
        self._sampling.reset()

    def measure(self, truth: Truth, time_s: float) -> Reading | None:
        """`SurfacePositions`, with their covariance (n, n); None between two measurements or of other robots."""
        if truth.surfaces is None or not self._sampling.is_due(time_s):
            return None
        spec, true = self._spec, truth.surfaces
        turned = np.array([not name.startswith("throttle") for name in true.names])
        positions = np.array(true.positions, dtype=float)
        if self._noisy:
            positions += np.where(turned, spec.std, 0.0) * self._rng.standard_normal(len(positions))
            if spec.quantum:
                positions = np.where(turned, np.round(positions / spec.quantum) * spec.quantum, positions)
        spread = np.where(turned, spec.std**2 + spec.quantum**2 / 12.0, 0.0)
        return Reading(SurfacePositions(true.names, positions), covariance=np.diag(spread))


def _write(reading: Reading, _spec: SurfacesSpec) -> list[Any]:
    return [list(reading.value.names), reading.value.positions.tolist()]


def _read(values: Sequence[Any]) -> Reading:
    names, positions = values
    return Reading(SurfacePositions(tuple(names), np.array(positions, dtype=float)))


KIND = SensorKind(
    spec=SurfacesSpec,
    wire=Wire(
        "surfaces/state", "sensor_msgs/msg/JointState", "plant", "stream", "`rate_hz` of the servos, else each tick",
        "measured deflection of each surface and level of each throttle of an aircraft; `position` by actuator name",
        unit="rad, 0 to 1",
    ),
    frame="base_link",
    message=MessageFields(paths=("name", "position"), write=_write, read=_read),
    simulate=ServoSensors,
    plausible=(
        Plausible("std", "rad", (0.0, 0.5), (0.0, 0.05), "potentiometers of servos"),
        Plausible("quantum", "rad", (0.0, 0.2), (0.0, 0.02), "magnetic encoders: 12 bit a turn"),
        Plausible("rate_hz", "Hz", (0.05, 1e4), (0.5, 1000.0), "servo electronics"),
    ),
)  # fmt: skip
