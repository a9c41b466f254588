"""Intervals of success rates that were counted over episodes, and of the difference of two."""

from __future__ import annotations

import math

Z95 = 1.96  # of the normal distribution, two-sided 95 %


def wilson(share: float, count: int) -> tuple[float, float]:
    """95 % interval of a share that was counted (E. B. Wilson 1927)."""
    spread = Z95**2 / count
    middle = (share + spread / 2.0) / (1.0 + spread)
    half = Z95 * math.sqrt(share * (1.0 - share) / count + spread / (4.0 * count)) / (1.0 + spread)
    return max(0.0, middle - half), min(1.0, middle + half)


def gain_interval(before: float, after: float, count: int) -> tuple[float, float]:
    """95 % interval of `after - before`, two shares that were each counted over `count` episodes.

    R. G. Newcombe, "Interval estimation for the difference between independent proportions", 1998, method 10. The
    episodes of both are the same, which makes it wider than need be.
    """
    (low, high), (new_low, new_high) = wilson(before, count), wilson(after, count)
    gain = after - before
    below = math.hypot(after - new_low, high - before)
    above = math.hypot(new_high - after, before - low)
    return gain - below, gain + above
