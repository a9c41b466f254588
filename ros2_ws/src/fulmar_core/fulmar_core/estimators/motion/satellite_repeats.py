"""Sensors of a satellite that repeat themselves: to the last bit, no two readings of a noisy sensor are equal.

A repeated value of a sensor whose values are no multiples of a quantum is no measurement, and is not used at all.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fulmar_core.robots.sensors.repetition import FEWEST, FROZEN_AFTER, RepetitionCheck, is_noisy

STAR_TRACKER = "the star tracker repeats itself to the last bit: it is frozen"
GYROSCOPE = "the gyroscope repeats itself to the last bit: it is frozen"
EVENTS = "the rate of the event cameras repeats itself to the last bit: it is frozen"
WHEEL = "the tachometer of {wheel} repeats itself to the last bit: it is frozen"


class SatelliteRepeats:
    """Repeated readings of star tracker, gyroscope, event cameras and of each wheel."""

    def __init__(self, sensors: Any, wheels: tuple[str, ...], *, tick_s: float = 0.0) -> None:
        """Begin without readings.

        Args:
            sensors: Of the robot, `fulmar_core.robots.robot.Sensors`; they say which noise they have.
            wheels: Names of the wheels.
            tick_s: Time between readings of a simulated inertial unit, which repeats a slow one's newest [s].
        """
        imu, tracker, tachometers = sensors.imu, sensors.star_tracker, sensors.wheels
        gyroscope = imu.gyroscope
        slow = math.ceil(1.0 / (imu.rate_hz * tick_s)) if imu.rate_hz * tick_s > 0.0 else 1
        self._words = {"star_tracker": STAR_TRACKER, "imu": GYROSCOPE, "rate": EVENTS}
        self._checks = {
            "star_tracker": RepetitionCheck(after=FEWEST if tracker is None or is_noisy(tracker) else 0),
            "imu": RepetitionCheck(after=slow * FROZEN_AFTER if is_noisy(gyroscope) else 0),
            "rate": RepetitionCheck(after=FEWEST),
        }
        noisy = tachometers is None or is_noisy(tachometers)
        for name in wheels:
            self._words[name] = WHEEL.format(wheel=name)
            self._checks[name] = RepetitionCheck(after=FROZEN_AFTER if noisy else 0)
        self._wheels = wheels
        by_steps = {"imu": gyroscope.quantum} | dict.fromkeys(wheels, tachometers and tachometers.quantum)
        self._by_steps = {
            name for name, quantum in by_steps.items() if quantum
        }  # may repeat themselves by chance

    @property
    def frozen(self) -> tuple[str, ...]:
        """Which sensors are frozen now, a sentence each."""
        return tuple(self._words[name] for name, check in self._checks.items() if check.frozen)

    def see(self, name: str, value: np.ndarray, stamp_ns: int) -> str:
        """Note a reading; why it is no measurement, or empty.

        Args:
            name: `star_tracker`, `imu`, `rate`, or that of a wheel.
            value: What is measured, not to be changed later.
            stamp_ns: When [ns].
        """
        check = self._checks[name]
        frozen = check.see(value, stamp_ns)
        repeats = check.repeats > 0 and name not in self._by_steps
        return self._words[name] if frozen or repeats else ""

    def see_wheels(self, speeds: np.ndarray, stamp_ns: int) -> str:
        """Note the speeds of all wheels; why one of them is no measurement, or empty.

        A tachometer that counts turns reads 0 again and again from a wheel that stands.
        """
        problems = []
        for name, speed in zip(self._wheels, speeds, strict=True):
            if speed:
                problems.append(self.see(name, np.array(speed), stamp_ns))
            else:
                self._checks[name].forget()
        return "; ".join(filter(None, problems))
