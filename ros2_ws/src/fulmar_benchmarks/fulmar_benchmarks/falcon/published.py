"""Figures of the thesis, chapter 5: Tables 5.6 to 5.8.

RMSE there is per axis, √(1/(3N) Σ‖e‖²), whatever Table 5.5 says: RMSE = √(mean² + std²) / √3 holds in every row of
Tables 5.7 to 5.10. What it calls overshoot is the largest error, its start included. A run marked * crashed.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class Row:
    """One row of a table."""

    rmse_per_axis_m: float
    settling_s: float | None
    peak_error_m: float
    energy: float
    crashed: bool = False

    def as_json(self) -> dict[str, Any]:
        """As in `fulmar benchmark falcon --json`."""
        return asdict(self)


LQR = {  # Table 5.8
    "a": Row(0.025, 1.48, 0.211, 0.663),
    "b": Row(0.052, 41.55, 0.671, 0.370),
    "c": Row(0.213, 44.06, 1.708, 0.379),
    "d": Row(0.017, 2.94, 0.213, 0.303),
    "e": Row(0.019, 2.40, 0.209, 0.583),
    "f": Row(0.149, None, 0.704, 0.565),
}
MPPI = {  # Table 5.7
    "a": Row(0.012, 0.01, 0.070, 0.780),
    "b": Row(1.075, None, 3.836, 0.367, crashed=True),
    "c": Row(3.046, None, 11.256, 0.340, crashed=True),
    "d": Row(0.008, 0.01, 0.081, 0.525),
    "e": Row(0.010, 0.01, 0.088, 0.757),
    "f": Row(0.814, None, 4.581, 0.419, crashed=True),
}
DREAMER_ALTITUDE_RMSE = 1.309  # Table 5.6, over the height alone; its 0.756 is the same per axis [m]
BESIDE = {"lqi": LQR, "lqr": LQR, "mppi": MPPI}  # which table stands beside a controller of ours
