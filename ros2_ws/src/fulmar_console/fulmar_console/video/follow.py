"""A camera that follows robots: their goal and the thing that they look at stay in view."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.states.rotation import wrap_angle

SLOW_S = 1.2  # time constant of the point that it looks at, and of its distance [s]
TURN_S = 3.0  # and of its direction [s]
PULL = 0.4  # how far it looks from the robots towards goals
GLANCE = 0.2  # and towards the thing that they look at
ORBIT_DEG = 1.5  # a second, where nothing sets a direction
FIRST_DEG = 60.0  # azimuth where nothing sets one
BESIDE_DEG = 140.0  # of the way of an aircraft, so that it is seen from ahead and the side
PAST_DEG = 28.0  # of the line from a robot in space to the thing that it looks at
ELEVATION_DEG = {"plane": -34.0, "water": -24.0, "flight": -14.0}
NEAR = 4.2  # distance without a goal, by how far the largest robot reaches


@dataclass(frozen=True)
class View:
    """Where the camera looks: a point [m], distance [m], azimuth and elevation [deg]."""

    at: np.ndarray
    distance: float
    azimuth: float
    elevation: float


class Follower:
    """Moves a view smoothly."""

    def __init__(self, info: Mapping[str, Any], reach: float) -> None:
        """Begin; `info` is that of the first robot, `reach` how far the largest reaches [m]."""
        self._space = str(info.get("space", "plane"))
        self._reach = reach
        parts = [part["pose"][:3] for each in info.get("structures") or () for part in each["parts"]]
        self._thing = np.mean(np.array(parts, dtype=float), axis=0) if parts else None
        self._view: View | None = None
        self._middle = np.zeros(3)

    def look(self, places: np.ndarray, goals: Sequence[np.ndarray], dt: float) -> View:
        """The view after a time.

        Args:
            places: Of the robots, shape (n, 3) [m].
            goals: Places that should be seen as well, each shape (3,) [m].
            dt: Since the call before [s]; the first one jumps there.
        """
        middle = places.mean(axis=0)
        moved, self._middle = middle - self._middle, middle
        near = [goal for goal in goals if np.linalg.norm(goal - middle) < 20.0 * self._reach]
        at = middle + (PULL * (np.mean(near, axis=0) - middle) if near else 0.0)
        if self._thing is not None:
            at = middle + GLANCE * (self._thing - middle)
        spread = max(float(np.linalg.norm(each - at)) for each in (*places, *near))
        distance = NEAR * self._reach + 1.25 * spread
        azimuth = self._azimuth(middle, moved)
        old = self._view
        if old is None:
            self._view = View(at, distance, FIRST_DEG if azimuth is None else azimuth, self._elevation())
            return self._view
        slow, turn = (1.0 - math.exp(-dt / each) for each in (SLOW_S, TURN_S))
        # An aircraft is held in the middle: its way is taken whole, and only the rest slowly.
        held = old.at + (moved if self._space == "flight" else 0.0)
        turned = ORBIT_DEG * dt
        if azimuth is not None:
            turned = turn * math.degrees(float(wrap_angle(math.radians(azimuth - old.azimuth))))
        self._view = View(
            held + slow * (at - held),
            old.distance + slow * (distance - old.distance),
            old.azimuth + turned,
            old.elevation,
        )
        return self._view

    def _azimuth(self, middle: np.ndarray, moved: np.ndarray) -> float | None:
        """Direction of view that shows most [deg]; None where there is none."""
        if self._thing is not None:
            to = self._thing - middle
            return math.degrees(math.atan2(to[1], to[0])) + PAST_DEG
        if self._space == "flight" and self._view is None:
            return BESIDE_DEG
        if self._space == "flight" and math.hypot(moved[0], moved[1]) > 1e-3:
            return math.degrees(math.atan2(moved[1], moved[0])) + BESIDE_DEG
        return None

    def _elevation(self) -> float:
        return ELEVATION_DEG.get(self._space, -18.0)
