"""What a sensor reports at one instant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

# Between the stamps of two readings:
BACK_NS = 1_000_000_000  # further back than this is no reordering: the sensor has begun anew
FORWARD_NS = 10_000_000_000  # further ahead than this is no gap: it is another clock, or one wrong stamp


@dataclass(frozen=True, slots=True)
class Reading:
    """One measurement of one sensor.

    A device stamps its readings by a clock. A simulated sensor knows only how old its reading is.
    """

    value: Any  # of the sensor's own type, without a batch axis; see the sensor's file
    stamp_ns: int | None = (
        None  # when it was measured, on the plant's clock; None: `age_s` before its sample [ns]
    )
    covariance: np.ndarray | None = (
        None  # of the value, about the axes that the sensor's file names; None: unknown
    )
    age_s: float = 0.0  # of a reading without a stamp, when its sample was taken [s]

    def stamp(self, sample_ns: int) -> int:
        """When it was measured, with the time of its sample, on the plant's clock [ns]."""
        return self.stamp_ns if self.stamp_ns is not None else sample_ns - round(1e9 * self.age_s)
