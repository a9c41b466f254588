"""What simulated sensors share: random numbers of their own, and a rate and a delay."""

from __future__ import annotations

import zlib
from collections import deque
from dataclasses import replace

import numpy as np

from fulmar_core.states.counter_rng import NOISE
from fulmar_core.wires.reading import Reading

SLACK_S = 1e-6  # simulators add up their time step, and err by less than this in a day [s]


def sensor_rng(seed: int, number: int, sensor: str) -> np.random.Generator:
    """Random numbers of one sensor in one episode, whatever other sensors draw.

    Args:
        seed: Of the run.
        number: Of the episode.
        sensor: Name of the sensor, in place of the number of a stream: no two sensors can share one by mistake.
    """
    return np.random.default_rng((seed, number, NOISE, zlib.crc32(sensor.encode())))


class Sampling:
    """When a sensor measures, and when its readings arrive."""

    def __init__(self, rate_hz: float, delay_s: float) -> None:
        """Prepare.

        Args:
            rate_hz: Of measurements; 0: whenever it is asked [Hz].
            delay_s: From measurement to arrival [s].
        """
        self._rate_hz, self._delay_s = rate_hz, delay_s
        self.reset()

    def reset(self) -> None:
        """Begin an episode, with a measurement."""
        self._next_s = 0.0
        self._under_way: deque[tuple[float, Reading]] = deque()

    def is_due(self, time_s: float) -> bool:
        """Whether the sensor measures now; true once for each measurement."""
        if time_s < self._next_s - SLACK_S:
            return False
        if self._rate_hz:
            self._next_s = (np.floor((time_s + SLACK_S) * self._rate_hz) + 1.0) / self._rate_hz
        return True

    def put(self, reading: Reading, time_s: float) -> None:
        """Note a measurement of this time [s]."""
        self._under_way.append((time_s, reading))

    def take(self, time_s: float) -> Reading | None:
        """The newest reading that has arrived since the last call, with its age; None where none has."""
        arrived = None
        while self._under_way and self._under_way[0][0] <= time_s - self._delay_s + SLACK_S:
            measured_s, reading = self._under_way.popleft()
            arrived = replace(reading, age_s=time_s - measured_s)
        return arrived
