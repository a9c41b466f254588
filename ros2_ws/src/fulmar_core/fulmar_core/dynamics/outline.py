"""Where a robot's outline is: a disc, or a box, which may sit ahead of the body's origin."""

from __future__ import annotations

from dataclasses import dataclass

from fulmar_core.arrays import array_namespace, clip
from fulmar_core.robot import Robot
from fulmar_core.rotation import Array


@dataclass(frozen=True)
class Outline:
    """Everything within `rounding` of a box; a disc is a box without size."""

    ahead: float  # of the box's middle, from the body's origin [m]
    half_length: float  # [m]
    half_width: float  # [m]
    rounding: float  # [m]

    @property
    def extent(self) -> float:
        """How far the outline reaches from the body's origin [m]."""
        return float(((abs(self.ahead) + self.half_length) ** 2 + self.half_width**2) ** 0.5 + self.rounding)

    def nearest(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Point of the box that is nearest to another, both in the body's frame, shapes (...,) [m]."""
        near = clip(x - self.ahead, -self.half_length, self.half_length) + self.ahead
        return near, clip(y, -self.half_width, self.half_width)

    def gap(self, x: Array, y: Array) -> Array:
        """Distance of a point in the body's frame from the outline, negative inside a disc, shapes (...,) [m]."""
        xp = array_namespace(x)
        near_x, near_y = self.nearest(x, y)
        return xp.sqrt((x - near_x) ** 2 + (y - near_y) ** 2) - self.rounding


def outline_of(robot: Robot) -> Outline:
    """The outline that a robot's YAML describes."""
    if robot.body.footprint is None:
        return Outline(0.0, 0.0, 0.0, robot.body.radius)
    length, width = robot.body.footprint
    return Outline(robot.body.footprint_x, 0.5 * length, 0.5 * width, 0.0)
