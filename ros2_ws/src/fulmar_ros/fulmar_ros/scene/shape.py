"""One shape that a viewer draws, and the few builders of shapes."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

Point = tuple[float, ...]  # x, y, z [m]
Color = tuple[float, float, float, float]  # red, green, blue, opacity, each 0 to 1
Kind = Literal["arrow", "box", "sphere", "cylinder", "line", "segments", "spheres", "mesh"]

LINE_M = 0.02  # width of lines, our value [m]
FLAT_M = 0.01  # height of discs on the floor, our value [m]
ROUND = 48  # sides that a circle is drawn with


@dataclass(frozen=True)
class Shape:
    """One shape; a viewer replaces it by the next one of its group and number.

    Attributes:
        group: Such as `goal`; viewers switch groups on and off.
        number: Unique in its group, the same as long as it shows the same thing.
        kind: An arrow has two points, from tail to tip; `line` joins its points, `segments` each pair of them.
        in_body: Given in the frame of the body; otherwise in `odom`.
        size: Of a box, sphere or cylinder its extent along x, y, z; of an arrow the diameters of shaft and head and
            the length of the head, as RViz reads them; of lines their width [m].
        color: Of the whole shape.
        position: Of its middle [m].
        points: Of arrows and lines [m].
        quat: How it is turned: x, y, z, w.
        file: Of a mesh, whose `size` is metres per unit along its x, y, z.
    """

    group: str
    number: int
    kind: Kind
    in_body: bool
    size: tuple[float, float, float]
    color: Color
    position: Point = (0.0, 0.0, 0.0)
    points: tuple[Point, ...] = ()
    quat: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    file: str = ""

    @property
    def key(self) -> tuple[str, int]:
        """Unique among the shapes of a scene."""
        return self.group, self.number


def arrow(
    group: str, number: int, tail: Sequence[float], tip: Sequence[float], color: Color, *, in_body: bool
) -> Shape:
    """An arrow between two points [m]; thin where it is short."""
    length = math.dist(tail, tip)
    shaft = min(0.04, 0.1 * length)
    size = (shaft, 2.0 * shaft, min(0.1, 0.3 * length))
    return Shape(group, number, "arrow", in_body, size, color, points=(tuple(tail), tuple(tip)))


def line(group: str, number: int, points: Iterable[Sequence[float]], color: Color, *, in_body: bool) -> Shape:
    """A line through points [m]."""
    through = tuple(tuple(map(float, point)) for point in points)
    return Shape(group, number, "line", in_body, (LINE_M, 0.0, 0.0), color, points=through)


def segments(
    group: str, number: int, points: Iterable[Sequence[float]], color: Color, *, in_body: bool
) -> Shape:
    """Lines between the first and second point, the third and fourth, and so on [m]."""
    ends = tuple(tuple(map(float, point)) for point in points)
    return Shape(group, number, "segments", in_body, (LINE_M, 0.0, 0.0), color, points=ends)


def circle(
    center: Sequence[float], radius: float, axes: tuple[int, int] = (0, 1), turn: float = 2.0 * math.pi
) -> list[Point]:
    """Points of a circle or, with less than a full `turn`, of an arc from the first axis on.

    Args:
        center: x, y, z [m].
        radius: [m].
        axes: The two axes that it lies in: 0 for x, 1 for y, 2 for z.
        turn: Angle of the arc; negative turns the other way [rad].
    """
    steps = max(2, math.ceil(abs(turn) / (2.0 * math.pi) * ROUND))
    points = []
    for step in range(steps + 1):
        point = [float(part) for part in center]
        angle = turn * step / steps
        point[axes[0]] += radius * math.cos(angle)
        point[axes[1]] += radius * math.sin(angle)
        points.append(tuple(point))
    return points


def in_pairs(points: Sequence[Point]) -> list[Point]:
    """The ends of each segment of a line, for `segments`."""
    return [end for pair in itertools.pairwise(points) for end in pair]
