"""What a sensor reports at one instant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True, slots=True)
class Reading:
    """One measurement of one sensor."""

    value: Any  # of the sensor's own type, without a batch axis; see the sensor's file
    stamp_ns: int | None = None  # when it was measured, on the plant's clock; None: with its sample [ns]
    covariance: np.ndarray | None = (
        None  # of the value, about the axes that the sensor's file names; None: unknown
    )
