"""Specific force and turn rate as an inertial unit reports them (REP-145: +g at rest)."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from fulmar_core.counter_rng import NOISE
from fulmar_core.sensors.odometer import Channel, largest_reading

INERTIAL = 4  # stream of the unit's random numbers, beside that of the odometry


@dataclass(frozen=True)
class ImuSpec:
    """What an inertial unit reports, and when."""

    accelerometer: Channel = Channel()  # each axis [m/s²]
    gyroscope: Channel = Channel()  # each axis [rad/s]
    rate_hz: float = 0.0  # new readings; 0: with every one asked for [Hz]
    delay_s: float = 0.0  # from motion to reading [s]

    def __post_init__(self) -> None:
        if min(self.rate_hz, self.delay_s) < 0.0:
            raise ValueError("rate_hz and delay_s must not be negative.")

    def part(self, name: str) -> np.ndarray:
        """One number of the channels, for three axes of force and three of turning, shape (6,)."""
        return np.repeat([getattr(self.accelerometer, name), getattr(self.gyroscope, name)], 3)


@dataclass(frozen=True, slots=True)
class ImuSample:
    """One reading, in the frame of the unit."""

    specific_force: np.ndarray  # (3,) acceleration minus gravity [m/s²]
    angular_velocity: np.ndarray  # (3,) [rad/s]


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
        self._next_s = 0.0

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
            self._readings.append((time_s, self._read(truth)))
            if self._spec.rate_hz:
                self._next_s = (np.floor(time_s * self._spec.rate_hz + tiny) + 1.0) / self._spec.rate_hz
        while len(self._readings) > 1 and self._readings[1][0] <= time_s - self._spec.delay_s + tiny:
            self._readings.popleft()
        reading = self._readings[0][1]
        return ImuSample(reading[:3].copy(), reading[3:].copy())

    def _read(self, truth: ImuSample) -> np.ndarray:
        reading = np.concatenate((truth.specific_force, truth.angular_velocity))
        reading = reading * self._scale + self._bias + self._std * self._rng.standard_normal(6)
        reading = reading.clip(-self._most, self._most)
        return np.where(self._quantum > 0.0, (reading / self._step).round() * self._step, reading)
