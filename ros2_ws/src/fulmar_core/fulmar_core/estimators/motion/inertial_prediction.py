"""What poses made of an estimate, against what inertial readings alone say of the same seconds.

A filter that begins as the estimate was some seconds ago, and that no pose corrects, must differ from the estimate by
no more than its covariance: else poses or inertial readings lie. So a pose that stands or creeps is found as soon as
the body speeds up or turns, and so is an accelerometer whose bias changes faster than its settings say. This is
normalised solution separation: Young and McGraw, Navigation 50(3), 2003.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fulmar_core.estimators.motion.filter import IMU, Filter
from fulmar_core.states.rotation import size_of

LASTS_NS = 4_000_000_000  # how long a prediction is compared: its spread grows
EVERY_NS = 2_000_000_000  # a new one begins, so that one of at least this age is there


@dataclass(slots=True)
class Prediction:
    """One filter that inertial readings alone move on."""

    filter: Filter
    began_ns: int
    stamp_ns: int  # what it is about now
    late_std_s: float  # by how much the latency of poses may differ from that of the settings [s]
    inertial: Any = None  # the newest reading
    most: np.ndarray = field(
        default_factory=lambda: np.zeros(3)
    )  # largest speed, acceleration and turn rate so far

    def move(self, stamp_ns: int, inertial: Any) -> None:
        """Take an inertial reading."""
        if stamp_ns > self.stamp_ns:
            seconds = (stamp_ns - self.stamp_ns) / 1e9
            before = self.filter.velocity()
            self.filter.move_on(seconds, inertial)
            self.filter.correct(IMU, inertial)
            after = self.filter.velocity()
            acceleration = size_of(after - before) / seconds
            now = np.array([size_of(after), acceleration, self.filter.turn_rate()])
            self.most = np.maximum(self.most, now)
            self.stamp_ns, self.inertial = stamp_ns, inertial

    def separation2(self, believed: Filter, stamp_ns: int) -> float:
        """Squared distance of what is believed at a time from this prediction, in units of its covariance [-]."""
        now = self.filter.snapshot()
        self.filter.move_on((stamp_ns - self.stamp_ns) / 1e9, self.inertial)
        off, spread = believed.separation(self.filter)
        self.filter.restore(now)
        each = len(off) // 3 if len(off) % 3 == 0 else 2  # axes of place and of velocity; what is left turns
        place, speed, turn = ((self.late_std_s * self.most) ** 2).tolist()
        allowed = spread.copy()
        allowed.flat[:: len(off) + 1] += [place] * each + [speed] * each + [turn] * (len(off) - 2 * each)
        return float(off @ np.linalg.solve(allowed, off))


class InertialPredictions:
    """Some predictions side by side, begun one after the other."""

    def __init__(self, new_filter: Callable[[], Filter], *, gap_ns: int, late_std_s: float) -> None:
        """Begin without any.

        Args:
            new_filter: Makes a filter, whatever it believes.
            gap_ns: Time without inertial readings after which predictions are of no use [ns].
            late_std_s: By how much the latency of poses may differ from that of the settings [s].
        """
        self._new_filter, self._gap_ns = new_filter, gap_ns
        self._late_std_s = late_std_s
        self.forget()

    def forget(self) -> None:
        """Begin anew."""
        self._running: list[Prediction] = []
        self._newest_ns: int | None = None

    @property
    def oldest(self) -> Prediction | None:
        """The one that began first."""
        return self._running[0] if self._running else None

    def move(self, stamp_ns: int, inertial: Any) -> None:
        """Take an inertial reading; they come in order."""
        if self._newest_ns is not None and stamp_ns - self._newest_ns > self._gap_ns:
            self._running = []
        self._newest_ns = stamp_ns
        for prediction in self._running:
            prediction.move(stamp_ns, inertial)

    def separation2(self, believed: Filter, stamp_ns: int) -> float:
        """Largest squared distance from any of them [-]; 0 without one."""
        if self._newest_ns is None or stamp_ns - self._newest_ns > self._gap_ns:
            self._running = []
        return max((one.separation2(believed, stamp_ns) for one in self._running), default=0.0)

    def renew(self, believed: Filter, stamp_ns: int) -> None:
        """Begin another one from what is believed at a time, if it is due, and end what is too old."""
        if self._newest_ns is None or (self._running and stamp_ns - self._running[-1].began_ns < EVERY_NS):
            return
        fresh = self._new_filter()
        fresh.restore(believed.snapshot())
        self._running = [one for one in self._running if stamp_ns - one.began_ns < LASTS_NS]
        self._running.append(Prediction(fresh, stamp_ns, stamp_ns, self._late_std_s))
