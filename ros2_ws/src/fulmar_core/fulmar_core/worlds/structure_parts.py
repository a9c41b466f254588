"""Shapes of which a thing in space is made, what they are, and the volume about it that a robot stays out of."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from fulmar_core.states.arrays import array_namespace, is_numpy
from fulmar_core.states.rotation import Array, multiply, rotate

Shape = Literal["box", "cylinder", "sphere", "capsule"]
Color = tuple[float, float, float]  # red, green, blue, each 0 to 1
AT_THE_ORIGIN = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)  # x, y, z [m], then the quaternion w, x, y, z

# What a pixel of a segmentation shows: numbers, which datasets keep, and the usual colour of such a part.
SEMANTIC_IDS = {
    "background": 0,
    "module": 1,
    "truss": 2,
    "solar_panel": 3,
    "radiator": 4,
    "antenna": 5,
    "docking_port": 6,
    "engine": 7,
    "arm": 8,
    "bus": 9,
}
COLORS: dict[str, Color] = {
    "module": (0.86, 0.86, 0.84),
    "truss": (0.62, 0.62, 0.66),
    "solar_panel": (0.13, 0.20, 0.48),
    "radiator": (0.95, 0.95, 0.97),
    "antenna": (0.78, 0.74, 0.60),
    "docking_port": (0.35, 0.36, 0.40),
    "engine": (0.28, 0.25, 0.23),
    "arm": (0.90, 0.72, 0.35),
    "bus": (0.80, 0.62, 0.22),
}


@dataclass(frozen=True)
class Part:
    """One convex part.

    Attributes:
        name: Of its own in the structure.
        shape: What it is; round ones stand along their own z.
        size: Half sizes as MuJoCo takes them [m]: three of a box; radius and half length of a cylinder, and of the
            straight piece of a capsule; radius of a sphere.
        pose: Of its middle: x, y, z [m], then the quaternion w, x, y, z.
        semantic: A word of `SEMANTIC_IDS`.
        color: Red, green, blue, each 0 to 1.
    """

    name: str
    shape: Shape
    size: tuple[float, ...]
    pose: tuple[float, ...]
    semantic: str
    color: Color

    @property
    def half_box(self) -> np.ndarray:
        """Half sizes of the box in its own frame that encloses it, shape (3,) [m]."""
        if self.shape == "box":
            return np.array(self.size)
        radius, half = self.size[0], self.size[-1]
        if self.shape == "capsule":
            half += radius
        return np.array((radius, radius, half))

    @property
    def corners(self) -> np.ndarray:
        """Corners of that box in the structure's frame, shape (8, 3) [m]."""
        signs = np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, 8).T
        corners: np.ndarray = np.array(self.pose[:3]) + rotate(xyzw(self.pose), signs * self.half_box)
        return corners


@dataclass(frozen=True)
class KeepOut:
    """A capsule: everything that is nearer than `radius` to a line; a sphere where both ends are one point [m]."""

    start: tuple[float, float, float]
    end: tuple[float, float, float]
    radius: float

    def distance(self, points: Array) -> Array:
        """How far points (..., 3) lie outside of it, negative within; shape (...,) [m]."""
        return self.offset(points)[1]

    def offset(self, points: Array) -> tuple[Array, Array]:
        """Unit vectors straight away from it, shape (..., 3), and the distances of points (..., 3) [m]."""
        xp = array_namespace(points)
        start, along = _like(self.start, points), _like(self.end, points) - _like(self.start, points)
        length2 = sum((b - a) ** 2 for a, b in zip(self.start, self.end, strict=True))
        from_start = points - start
        share = (from_start * along).sum(-1) / length2 if length2 else 0.0 * from_start[..., 0]
        away = from_start - share.clip(0.0, 1.0)[..., None] * along
        far = xp.sqrt((away * away).sum(-1))
        return away / far.clip(1e-9, None)[..., None], far - self.radius

    def at(self, pose: tuple[float, ...]) -> KeepOut:
        """The same about a structure that stands elsewhere; `pose` as `Part.pose`, in the world."""
        start, end = (_moved(point, pose) for point in (self.start, self.end))
        return KeepOut(start, end, self.radius)


def moved_part(part: Part, pose: tuple[float, ...]) -> Part:
    """A part of a structure that stands elsewhere; `pose` as `Part.pose`, in the world."""
    x, y, z, w = multiply(xyzw(pose), xyzw(part.pose))
    place = _moved(part.pose[:3], pose)
    return replace(part, pose=(*place, float(w), float(x), float(y), float(z)))


def xyzw(pose: tuple[float, ...]) -> np.ndarray:
    """Quaternion of a pose in the order of ROS, shape (4,)."""
    return np.array((*pose[4:7], pose[3]))


def _moved(point: tuple[float, ...], pose: tuple[float, ...]) -> tuple[float, float, float]:
    x, y, z = np.array(pose[:3]) + rotate(xyzw(pose), np.array(point))
    return float(x), float(y), float(z)


def _like(point: tuple[float, ...], points: Array) -> Array:
    if is_numpy(points):
        return np.array(point)
    return array_namespace(points).asarray(point, dtype=points.dtype, device=points.device)
