"""A look in boxes, cylinders and spheres alone, for what draws nothing else: URDF and markers of RViz."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from fulmar_core.robots.look import Part
from fulmar_core.robots.mesh_file import read_mesh
from fulmar_core.states.rotation import rotate

THINNEST_M = 1e-4  # of a box around a flat mesh, our value [m]
CONE_STEPS = 5  # cylinders that a cone is drawn with, our value


def primitives_of(parts: Iterable[Part]) -> tuple[Part, ...]:
    """The same look without capsules and cones; meshes stay meshes.

    A capsule becomes a cylinder with two spheres, a cone a stack of cylinders that are as wide as it is at their
    middles.
    """
    return tuple(each for part in parts for each in _primitives(part))


def _primitives(part: Part) -> Iterator[Part]:
    if part.shape == "capsule":
        diameter, length = part.size
        straight = length - diameter
        if straight > 0.0:
            yield replace(part, shape="cylinder", size=(diameter, straight))
        for end in (-0.5, 0.5) if straight > 0.0 else (0.0,):
            yield replace(part, shape="sphere", size=(diameter,), at=_along(part, end * straight))
    elif part.shape == "cone":
        diameter, length = part.size
        step = length / CONE_STEPS
        for number in range(CONE_STEPS):
            middle = (number + 0.5) / CONE_STEPS  # from the base, of the length
            size, at = (diameter * (1.0 - middle), step), _along(part, (middle - 0.5) * length)
            yield replace(part, shape="cylinder", size=size, at=at)
    else:
        yield part


def boxed(part: Part) -> Part:
    """A mesh as its bounding box, for what draws no meshes; anything else as it is.

    Raises:
        ConfigError: The mesh cannot be read.
    """
    if part.shape != "mesh":
        return part
    low, high = (np.array(part.scale) * corner for corner in read_mesh(Path(part.file)).span)
    x, y, z = np.array(part.at) + rotate(np.array(part.quat_xyzw), 0.5 * (low + high))
    size = tuple(max(float(each), THINNEST_M) for each in np.abs(high - low))
    at = (float(x), float(y), float(z))
    return replace(part, shape="box", size=size, at=at, file="", scale=(1.0, 1.0, 1.0))


def _along(part: Part, way: float) -> tuple[float, float, float]:
    """A place on the part's own z, from its middle [m]."""
    x, y, z = np.array(part.at) + rotate(np.array(part.quat_xyzw), np.array([0.0, 0.0, way]))
    return float(x), float(y), float(z)
