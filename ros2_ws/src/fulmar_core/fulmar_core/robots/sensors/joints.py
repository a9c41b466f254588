"""What sensors of single joints have in common: encoders of servos, tachometers of reaction wheels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fulmar_core.robots.sensors.sampling import Sampling, sensor_rng


@dataclass(frozen=True)
class JointSpec:
    """What sensors of joints report, and when; noise and quantum are in the unit of what they measure."""

    std: float = 0.0  # white noise of each value
    quantum: float = 0.0  # values are whole multiples of this; 0: any
    rate_hz: float = 0.0  # of measurements; 0: one with each sample of the plant [Hz]

    def __post_init__(self) -> None:
        if min(self.std, self.quantum, self.rate_hz) < 0.0:
            raise ValueError("std, quantum and rate_hz must not be negative.")


class JointSensors:
    """Noise, quantisation and times of measurement of one simulated robot's joints."""

    name: str  # of the sensor, which its random numbers depend on

    def __init__(self, spec: JointSpec, noisy: bool) -> None:
        """Prepare; without noise every reading is the truth."""
        self._spec, self._noisy = spec, noisy
        self._sampling = Sampling(spec.rate_hz, 0.0)

    def reset(self, seed: int, number: int) -> None:
        """Begin an episode; see `SimulatedSensor`."""
        self._rng = sensor_rng(seed, number, self.name)
        self._sampling.reset()

    def with_errors(
        self, true: Sequence[float] | np.ndarray, measured: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Values with their errors, and their covariance, shapes (n,) and (n, n).

        Args:
            true: Shape (n,).
            measured: Which of them a sensor measures, the others being known without errors; shape (n,), truth values.
        """
        spec, values = self._spec, np.array(true, dtype=float)
        if self._noisy:
            values = values + np.where(measured, spec.std, 0.0) * self._rng.standard_normal(len(values))
            if spec.quantum:
                values = np.where(measured, np.round(values / spec.quantum) * spec.quantum, values)
        spread = spec.std**2 + spec.quantum**2 / 12.0
        return values, np.diag(np.where(measured, spread, 0.0))
