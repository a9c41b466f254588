"""References of FALCON-S (thesis §5.5.2): where an aircraft shall be beside its heading and above the water, over time.

The formulas are those of `elharirymatteo/falcon-s`, `controllers/lqr/reference.py`; (b) and (c) end at 59 s.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

RAMP_S = (0.0, 10.0, 30.0, 40.0, 50.0, 59.0)  # corners of (b) and (c)
RAMP_M = (1.0, 11.0, 11.0, 1.0, 1.0, 0.55)  # heights there


def ramps(t: np.ndarray) -> np.ndarray:
    """Up by 10 m in 10 s, level, down, level, and closer to the water [m]."""
    return np.asarray(np.interp(t, RAMP_S, RAMP_M))


Profile = Callable[[np.ndarray], np.ndarray]  # times [s] to metres
PATHS: dict[str, tuple[Profile, Profile]] = {  # to the left, and above the water
    "a": (lambda t: 0.0 * t, lambda t: 6.0 - 5.0 * np.cos(0.15 * t)),
    "b": (lambda t: 0.0 * t, ramps),
    "c": (ramps, ramps),
    "d": (lambda t: 5.0 * np.sin(0.03 * t), lambda t: 1.0 + 0.0 * t),
    "e": (lambda t: 3.0 * np.sin(0.03 * t), lambda t: 3.0 - 2.0 * np.cos(0.18 * t)),
    "f": (lambda t: 3.0 * np.sin(0.2 * t), lambda t: 3.0 - 2.0 * np.cos(0.2 * t)),
}


def through(waypoints: Sequence[tuple[float, float, float]], speed: float) -> tuple[Profile, Profile]:
    """Side and height of a path through waypoints (ahead, to the left, up) [m], which is flown at a speed [m/s].

    It is a monotone cubic between waypoints (Fritsch and Carlson, SIAM Journal on Numerical Analysis 17, 1980), which
    overshoots none of them. Before the first one and beyond the last one it is level and straight ahead.
    """
    ahead, side, above = np.array(waypoints, dtype=float).T
    times = ahead / speed

    def profile(values: np.ndarray) -> Profile:
        if len(values) == 1:
            return lambda t: values[0] + 0.0 * t
        from scipy.interpolate import PchipInterpolator  # slow to import, and only such paths need it

        curve = PchipInterpolator(times, values)
        return lambda t: np.asarray(curve(np.clip(t, times[0], times[-1])))

    return profile(side), profile(above)
