"""The outline of a robot's body from shapes that touch, or, without any, from those that are drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_evaluation.new_robot.description import Description, Solid

MILLIMETRES = 3  # digits of a length that is rounded up [m]
ROUND = 1.0 + 1e-9


@dataclass(frozen=True)
class Outline:
    """A disc or a box around the body, and its lowest and highest point, in the frame of the body [m].

    Attributes:
        radius: Of the circle around it, seen from above.
        footprint: Length and width of a box; None: it is a disc.
        middle: Of the box or the disc, x and y.
        low: Of the lowest point.
        high: Of the highest point.
        drawn: Whether it is from shapes that are drawn, for want of others.
    """

    radius: float
    footprint: tuple[float, float] | None
    middle: tuple[float, float]
    low: float
    high: float
    drawn: bool = False


def outline_of(description: Description) -> Outline | None:
    """The outline of a robot; None where its file has no shapes."""
    solids = description.contacts or description.visuals
    if not solids:
        return None
    drawn = not description.contacts
    corners = np.concatenate([solid.corners for solid in solids])
    low, high = corners.min(axis=0), corners.max(axis=0)
    ends = float(low[2]), float(high[2])
    disc = _disc(solids)
    if disc is not None:
        return Outline(disc, None, (0.0, 0.0), *ends, drawn)
    size, middle = high - low, 0.5 * (high + low)
    radius = _rounded_up(0.5 * float(np.hypot(size[0], size[1])))
    return Outline(
        radius, (float(size[0]), float(size[1])), (float(middle[0]), float(middle[1])), *ends, drawn
    )


def _disc(solids: tuple[Solid, ...]) -> float | None:
    """Radius of an upright round shape about the origin that has all others in it; None where there is none."""
    for solid in solids:
        upright = solid.shape == "sphere" or abs(solid.place.rotation[2, 2]) > 1.0 - 1e-9
        round_ = solid.shape in ("cylinder", "capsule", "sphere")
        if round_ and upright and np.hypot(*solid.place.position[:2]) < 1e-9:
            radius = 0.5 * solid.size[0]
            others = [each.corners for each in solids if each is not solid]
            most = max((float(np.hypot(*corner[:2])) for each in others for corner in each), default=0.0)
            if most <= radius * ROUND:
                return radius
    return None


def _rounded_up(length: float) -> float:
    scale = 10**MILLIMETRES
    return float(np.ceil(length * scale - 1e-9)) / scale
