"""Shares of full thrust as devices may be told them."""

from __future__ import annotations

import math


def bounded(left: float, right: float) -> tuple[float, float]:
    """Shares of full thrust within -1 to 1.

    Where one is no finite number, both propellers stand: `min` and `max` would make full thrust of it, and one alone
    would turn the boat.
    """
    if not (math.isfinite(left) and math.isfinite(right)):
        return 0.0, 0.0
    return max(-1.0, min(1.0, left)), max(-1.0, min(1.0, right))
