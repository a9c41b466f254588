"""Odometry of a differential drive from encoders and gyroscope, and detection of stalled wheels."""

from __future__ import annotations

import math

import numpy as np

from fulmar_core.states.planar import PlanarState
from fulmar_core.states.rotation import wrap_angle
from fulmar_core.states.state import RigidBodyState

COUNTS = 1 << 16  # encoders count up to here and begin again
LONGEST_GAP_S = 0.5  # the speed after a longer gap is zero
JUMP_M = 0.05  # our value: beyond what the highest speed explains, for reports that came late


class WheelOdometry:
    """Dead reckoning: distance from the wheels, heading from the gyroscope, both from one report to the next."""

    def __init__(self, metres_per_count: float) -> None:
        """Prepare for `begin`.

        Args:
            metres_per_count: What a wheel rolls on one count of its encoder, > 0 [m].
        """
        self._scale = metres_per_count
        self.begin(0.0, 0.0, 0.0)

    def begin(self, x: float, y: float, heading: float) -> None:
        """Say where the base stands now [m, m, rad]."""
        self._x, self._y, self._heading = x, y, heading
        self._left: int | None = None
        self._right, self._gyro, self._time_s = 0, 0.0, 0.0

    def problem(self, left: int, right: int, time_s: float, fastest: float) -> str:
        """Why no base has rolled so since the last report, such as one that was switched off and on; empty if one may.

        Args:
            left: As in `see`.
            right: Same.
            time_s: Same.
            fastest: Highest speed of a rim [m/s].
        """
        if self._left is None:
            return ""
        rolled = self._scale * max(abs(_rolled(left - self._left)), abs(_rolled(right - self._right)))
        if rolled <= fastest * max(0.0, time_s - self._time_s) + JUMP_M:
            return ""
        return "a wheel's count jumped: was the base switched off and on?"

    def see(self, left: int, right: int, gyro: float, yaw_rate: float, time_s: float) -> RigidBodyState:
        """Take a report.

        Args:
            left: Count of the left wheel, 0 to 65535.
            right: Count of the right wheel.
            gyro: Heading as the gyroscope sums it up, any multiple of a turn added [rad].
            yaw_rate: [rad/s].
            time_s: When it was measured [s].

        Returns:
            Where the base is, in the frame that `begin` named.
        """
        passed_s = time_s - self._time_s
        speed = 0.0
        if self._left is not None:
            turned = float(wrap_angle(np.asarray(gyro - self._gyro)))
            ahead = 0.5 * self._scale * (_rolled(left - self._left) + _rolled(right - self._right))
            middle = self._heading + 0.5 * turned  # an arc's chord points half-way between its ends
            self._x += ahead * math.cos(middle)
            self._y += ahead * math.sin(middle)
            self._heading += turned
            speed = ahead / passed_s if 0.0 < passed_s < LONGEST_GAP_S else 0.0
        self._left, self._right, self._gyro, self._time_s = left, right, gyro, time_s
        c, s = math.cos(self._heading), math.sin(self._heading)
        values = (self._x, self._y, self._heading, speed * c, speed * s, yaw_rate)
        return PlanarState(*(np.asarray(value) for value in values)).to_rigid()


def _rolled(counts: int) -> int:
    """Difference of two counts, the short way round."""
    return (counts + COUNTS // 2) % COUNTS - COUNTS // 2


LEAST = 0.05  # friction alone may hold a wheel below this speed [m/s]
LONGEST_S = 1.0  # our value: a free base rolls long before


class StalledWheels:
    """Detects commanded wheels whose encoders stand: odometry is then no measurement any more."""

    def __init__(self) -> None:
        self._counts: np.ndarray | None = None

    def problem(self, commanded: np.ndarray, counts: np.ndarray, time_s: float) -> str:
        """Take a reading.

        Args:
            commanded: Speed of each rim, shape (n,) [m/s].
            counts: Of each encoder, shape (n,).
            time_s: When it was read [s].

        Returns:
            The problem; empty if there is none.
        """
        if self._counts is None:
            self._counts, self._moved_s = counts, np.full(len(counts), time_s)
        well = (counts != self._counts) | (np.abs(commanded) < LEAST)
        self._counts, self._moved_s = counts, np.where(well, time_s, self._moved_s)
        if np.all(time_s - self._moved_s <= LONGEST_S):
            return ""
        return (
            f"a wheel is commanded to turn, and its encoder has stood for {LONGEST_S:g} s. "
            "Is the base blocked, or a cable off?"
        )
