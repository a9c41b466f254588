"""Room of wings to the sides: they cannot stop, but they can fly level turns, and a whole circle has to lie inside."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.envelope.room import FENCE
from fulmar_core.safety.geofence import NO_AREA
from fulmar_core.states.gravity import GRAVITY
from fulmar_core.states.spatial import SpatialState

BANK_DEG = 15.0  # of the turns: more would dip a wing's tip into the water [deg]
ROLL_IN_S = 2.0  # until a craft turns as it shall [s]
WIDE = 1.2  # of the circle, for a craft that flies faster or banks less [-]


@dataclass(frozen=True)
class CircleRoom:
    """How much room n craft have, and to which side they would turn.

    Attributes:
        metres: Between the circle and each bound, shape (n, bounds) [m].
        turn: +1 to the left, -1 to the right, shape (n,).
    """

    metres: np.ndarray
    turn: np.ndarray


class Circles:
    """Circles of craft of one kind within an area, and within a corridor along the world's x, about a goal.

    Attributes:
        names: Of the bounds.
        radius: Of the circle [m].
        lead: Way until a craft turns as it shall [m].
        height: Least and greatest height of the area [m].
    """

    def __init__(self, robot: Robot, area: tuple[float, ...], fence: float) -> None:
        """Take the bounds.

        Args:
            robot: An aircraft.
            area: Six sides in the form of `check_area`; `NO_AREA` for none [m].
            fence: Farthest to the side of the goal; infinite for none [m].

        Raises:
            ConfigError: No circle fits into the area.
        """
        bounded = tuple(area) != NO_AREA
        self.radius = WIDE * robot.wings.speed**2 / (GRAVITY * math.tan(math.radians(BANK_DEG)))
        self.lead = ROLL_IN_S * robot.wings.speed
        self._low, self._high = (np.array(area[i:4:2]) if bounded else np.zeros(0) for i in (0, 1))
        self.height = (area[4], area[5]) if bounded else (0.0, math.inf)
        self._fence = fence
        axes = "xy" if bounded else ""
        self.names = (*(f"{axis}_min" for axis in axes), *(f"{axis}_max" for axis in axes), FENCE)
        if bounded and (self._high - self._low).min() < 2.0 * self.radius:
            raise ConfigError(
                f"an area of {' x '.join(f'{side:.0f}' for side in self._high - self._low)} m holds no level turn of "
                f"'{robot.name}' at {BANK_DEG:g}° of bank, which is {2.0 * self.radius:.0f} m wide. Give a "
                "wider --area, or leave out --guard."
            )

    def room(self, state: SpatialState, seconds: float, goal: np.ndarray | None) -> CircleRoom:
        """Room after some time of straight flight.

        Args:
            state: Now, shapes (n,).
            seconds: Time of the controller's step [s].
            goal: Place that the corridor is about, shape (n, 3); None: none [m].
        """
        speed = np.maximum(np.hypot(state.vx, state.vy), 1e-6)
        along = (state.vx + 1j * state.vy) / speed
        begins = state.x + 1j * state.y + along * (self.lead + seconds * speed)
        sides = [self._distances(begins + turn * 1j * self.radius * along, goal) for turn in (1.0, -1.0)]
        left = sides[0].min(axis=1) >= sides[1].min(axis=1)
        return CircleRoom(np.where(left[:, None], *sides), np.where(left, 1.0, -1.0))

    def _distances(self, middle: np.ndarray, goal: np.ndarray | None) -> np.ndarray:
        """Between circles about some places (n,) and each bound, shape (n, bounds) [m]."""
        far: list[np.ndarray] = []
        if len(self._low):
            place = np.stack((middle.real, middle.imag))
            far += [place[i] - self._low[i] - self.radius for i in range(2)]
            far += [self._high[i] - place[i] - self.radius for i in range(2)]
        if goal is None or not np.isfinite(self._fence):
            far.append(np.full(len(middle), np.inf))
        else:
            far.append(self._fence - np.abs(middle.imag - goal[:, 1]) - self.radius)
        return np.stack(far, axis=-1)
