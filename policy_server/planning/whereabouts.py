"""Where a boat is on a course that it knows, from the few waypoints that it sees."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_AGAIN = 1e-6  # cost of each waypoint further on, where a course passes the same places again


@dataclass(frozen=True)
class Whereabouts:
    """A pose in the world in which the course was told, and which waypoint comes next."""

    x: float  # [m]
    y: float  # [m]
    yaw: float  # continued beyond a turn [rad]
    coming: int  # number of the next waypoint in the course


def locate(sight: np.ndarray, places: np.ndarray, before: Whereabouts | None) -> Whereabouts:
    """Find the pose and the number of the next waypoint that explain what is seen.

    Args:
        sight: Waypoints from the next one on in the body's frame, as complex numbers ahead + i left, at least two [m].
        places: All waypoints, as complex numbers x + i y, shape (k,) [m].
        before: What was found a step ago, which decides where a course is like itself; None at the beginning, and then
            the first waypoint of those that would be seen alike.

    Returns:
        The best explanation.
    """
    count = len(places)
    ahead = places[(np.arange(count)[:, None] + np.arange(len(sight))) % count]
    # Rotation and shift of least squares (Umeyama 1991, in the plane).
    of_seen, of_told = sight - sight.mean(), ahead - ahead.mean(axis=1, keepdims=True)
    turn = np.angle(np.sum(of_told * np.conj(of_seen), axis=1))
    here = ahead.mean(axis=1) - np.exp(1j * turn) * sight.mean()
    off = np.abs(ahead - here[:, None] - np.exp(1j * turn)[:, None] * sight).sum(axis=1)
    if before is None:
        best = int(np.argmin(off > 1e-3 + off.min()))  # the first of those that explain it equally well
        return Whereabouts(float(here[best].real), float(here[best].imag), float(turn[best]), best)
    away = np.abs(here - complex(before.x, before.y))
    turned = np.remainder(turn - before.yaw + np.pi, 2.0 * np.pi) - np.pi
    further = (np.arange(count) - before.coming) % count
    best = int(np.argmin(off + away + np.abs(turned) + _AGAIN * further))
    return Whereabouts(float(here[best].real), float(here[best].imag), before.yaw + float(turned[best]), best)
