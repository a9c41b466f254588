"""The area that a robot must not leave: walls of a laboratory, a buoyed piece of water."""

from __future__ import annotations

import math
from collections.abc import Sequence

NO_AREA = (0.0, 0.0, 0.0, 0.0)  # an area without extent stands for none


def check_area(area: Sequence[float]) -> None:
    """Refuse what is no area.

    Args:
        area: x_min, x_max, y_min, y_max [m].

    Raises:
        ValueError: If it is none.
    """
    good = len(area) == 4 and all(math.isfinite(side) for side in area)
    if not good or not (area[0] < area[1] and area[2] < area[3]):
        raise ValueError(
            f"area = {list(area)} must be x_min, x_max, y_min, y_max with x_min < x_max, y_min < y_max."
        )


def outside(x: float, y: float, area: Sequence[float]) -> str:
    """How a place lies outside an area; empty if it does not [m]."""
    if tuple(area) == NO_AREA or (area[0] <= x <= area[1] and area[2] <= y <= area[3]):
        return ""
    return (
        f"the robot was at x = {x:.2f} m, y = {y:.2f} m, outside its area of x {area[0]:g} to {area[1]:g} m, "
        f"y {area[2]:g} to {area[3]:g} m. Bring it back by hand, then give a goal."
    )
