"""A way around discs: along the tangents of what stands in the way.

The shortest way around discs begins with a straight line that touches one of them (Liu and Arimoto, "Path
planning using a tangent graph for mobile robots among polygonal and curved obstacles", IJRR 11(4), 1992). As
TangentBug does (Kamon, Rimon and Rivlin, "TangentBug: a range-sensor-based navigation algorithm", IJRR 17(9),
1998), this line is chosen anew in each moment, from what is in sight: of the lines to the goal itself and
along the tangents of every disc, the one that promises the shortest way. Who has begun to pass discs on one
side prefers that side until the way to the goal is free. Speed is no more than lets the robot stop before
what it moves towards (the admissible velocities of Fox, Burgard and Thrun, "The dynamic window approach to
collision avoidance", IEEE RAM 4(1), 1997).

It knows no more than the few discs that a task shows at once, so a pocket of discs can hold it forever.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.controllers.seen import Vector

BLOCKED = 100.0  # cost of a line through a disc, far beyond any way [m]
OTHER_SIDE = 3.0  # metres of detour that are worth not to change sides [m]
CREEP = 0.15  # shortest way that is told, so that a robot that stands at an obstacle can still leave [m]


@dataclass(frozen=True)
class Around:
    """How far from obstacles, and how willing to turn."""

    clearance: float  # from the body's centre to an obstacle's edge [m]
    turn_cost: float  # metres of detour that are worth a turn of one radian [m/rad]
    speed: float  # fastest, as a share of the speed where nothing stands about [-]

    def __post_init__(self) -> None:
        """Refuse a robot without size."""
        if min(self.clearance, self.speed) <= 0.0 or self.turn_cost < 0.0:
            raise ValueError("'clearance' and 'speed' must be greater than 0, 'turn_cost' not negative.")

    def aim(
        self,
        goal: Vector,
        discs: tuple[np.ndarray, np.ndarray, float],
        course: np.ndarray,
        side: np.ndarray,
    ) -> tuple[Vector, np.ndarray, np.ndarray]:
        """Where to go instead of straight to the goal.

        Args:
            goal: Way to the goal in the body's frame, shapes (...,) [m].
            discs: Centres in the body's frame, shapes (..., k) [m], and the radius of all [m].
            course: Direction of travel in the body's frame, shape (...,) [rad].
            side: On which discs were passed so far: 1 to their left, -1 to their right, 0 for none, shape (...,).

        Returns:
            A vector in the direction to take, as long as the way that it promises, in the body's frame, shapes
            (...,) [m]; the distance that is free in the direction of travel, shape (...,) [m]; and the side from
            now on.
        """
        x, y, radius = discs
        wide = self.clearance + radius
        angles, lengths = _lines(goal, x, y, wide)
        ux, uy = np.cos(angles), np.sin(angles)
        way = lengths + np.hypot(goal[0][..., None] - lengths * ux, goal[1][..., None] - lengths * uy)
        off_course = angles - course[..., None]
        turn = np.abs(np.arctan2(np.sin(off_course), np.cos(off_course)))
        blocked = BLOCKED * _hits(ux, uy, lengths, x, y, wide)
        sides = np.concatenate((np.zeros(1), np.ones(x.shape[-1]), -np.ones(x.shape[-1])))
        change = OTHER_SIDE * (sides * side[..., None] < 0.0)
        best = np.argmin(way + self.turn_cost * turn + blocked + change, axis=-1)[..., None]
        ux, uy, way = (np.take_along_axis(a, best, axis=-1)[..., 0] for a in (ux, uy, way))
        room = np.maximum(_room(x, y, course, wide), CREEP)
        return (way * ux, way * uy), room, sides[best[..., 0]]


def _lines(goal: Vector, x: np.ndarray, y: np.ndarray, wide: float) -> tuple[np.ndarray, np.ndarray]:
    """Angles and lengths of the lines to the goal and along the tangents of every disc, shapes (..., 2 k + 1)."""
    far, bearing = np.hypot(x, y), np.arctan2(y, x)
    # Inside a disc the way out leads away from its centre, the more the deeper.
    outside, depth = np.maximum(far, wide), np.clip(1.0 - far / wide, 0.0, 1.0)
    half = np.arcsin(wide / outside) + 0.5 * np.pi * depth
    tangent = np.maximum(np.sqrt(np.maximum(outside * outside - wide * wide, 0.0)), 0.1 * wide)
    angles = np.concatenate(
        (np.arctan2(goal[1], goal[0])[..., None], bearing + half, bearing - half), axis=-1
    )
    return angles, np.concatenate((np.hypot(*goal)[..., None], tangent, tangent), axis=-1)


def _hits(
    ux: np.ndarray, uy: np.ndarray, lengths: np.ndarray, x: np.ndarray, y: np.ndarray, wide: float
) -> np.ndarray:
    """How many discs each line enters, and between how many that overlap it leads, shape (..., lines).

    Who leaves a disc does not enter it.
    """
    close = np.hypot(x[..., :, None] - x[..., None, :], y[..., :, None] - y[..., None, :]) < 2.0 * wide
    x, y, ux, uy = x[..., None, :], y[..., None, :], ux[..., None], uy[..., None]
    along, left = ux * x + uy * y, ux * y - uy * x
    nearest = np.clip(along, 0.0, lengths[..., None])
    enters = (along > 0.0) & (np.hypot(x - nearest * ux, y - nearest * uy) < 0.98 * wide)
    ahead = (along > 0.0) & (along < lengths[..., None] + wide)
    apart = (left[..., :, None] > 0.0) & (left[..., None, :] < 0.0)
    between = close[..., None, :, :] & apart & ahead[..., :, None] & ahead[..., None, :]
    return np.asarray(np.sum(enters, axis=-1) + np.sum(between, axis=(-2, -1)))


def _room(x: np.ndarray, y: np.ndarray, course: np.ndarray, wide: float) -> np.ndarray:
    """How far it is along the course to the first disc, shape (...,) [m]."""
    c, s = np.cos(course)[..., None], np.sin(course)[..., None]
    along, beside = c * x + s * y, c * y - s * x
    to_edge = along - np.sqrt(np.maximum(wide * wide - beside * beside, 0.0))
    ahead = (np.abs(beside) < wide) & (along > 0.0)
    return np.asarray(np.min(np.where(ahead, np.maximum(to_edge, 0.0), np.inf), axis=-1))
