"""What is free ahead of a robot among discs.

Speed is no more than lets it stop before what it moves towards (the admissible velocities of Fox, Burgard and Thrun,
"The dynamic window approach to collision avoidance", IEEE RAM 4(1), 1997).
"""

from __future__ import annotations

import numpy as np

CREEP = 0.15  # least distance that is told, so that a robot that stands at an obstacle can still leave [m]


def room_ahead(discs: tuple[np.ndarray, np.ndarray, np.ndarray], course: np.ndarray) -> np.ndarray:
    """How far it is along the course to the first disc.

    Args:
        discs: Centres in the body's frame and widths, three arrays of shape (..., k) [m].
        course: Direction of travel in the body's frame, shape (...,) [rad].

    Returns:
        Shape (...,), infinite where nothing is in the way [m].
    """
    x, y, wide = discs
    c, s = np.cos(course)[..., None], np.sin(course)[..., None]
    along, beside = c * x + s * y, c * y - s * x
    to_edge = along - np.sqrt(np.maximum(wide * wide - beside * beside, 0.0))
    ahead = (np.abs(beside) < wide) & (along > 0.0)
    room = np.where(ahead, np.maximum(to_edge, CREEP), np.inf)
    return np.asarray(np.min(room, axis=-1, initial=np.inf))
