"""Bodies of robots and things in space as plain primitives and meshes, as viewers take them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.robots.mesh_outline import unpacked
from fulmar_core.worlds.structures import xyzw

PLAIN_RADIUS = 0.3  # of a robot of which nothing is known [m]
Rgba = tuple[float, float, float, float]


@dataclass(frozen=True)
class DrawnPart:
    """One primitive or mesh.

    Of a `cylinder` or `capsule` size is diameter, diameter and length along z, else x, y, z [m]; `mesh` has points and
    the numbers of the corners of its triangles.
    """

    shape: str  # box, sphere, cylinder, capsule, cone or mesh
    size: tuple[float, float, float]
    at: tuple[float, float, float]
    quat_xyzw: tuple[float, float, float, float]
    rgba: Rgba
    mesh: tuple[np.ndarray, np.ndarray] | None = None


def parts_of(record: Mapping[str, Any]) -> list[DrawnPart]:
    """The body of a robot's record, in the frame of its body; a ball where nothing is known of it."""
    info = record.get("info") or {}
    own = rgba_of(str(record.get("color", "#8899aa")))
    parts = [_of_look(part, own) for part in info.get("look") or ()]
    width = 2.0 * float(info.get("radius") or PLAIN_RADIUS)
    ball = DrawnPart("sphere", (width, width, width), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), own)
    return parts or [ball]


def structures_of(record: Mapping[str, Any]) -> list[DrawnPart]:
    """The things in space that a robot's record has, in the world."""
    found = []
    for structure in (record.get("info") or {}).get("structures") or ():
        for part in structure["parts"]:
            half = [2.0 * float(each) for each in part["size"]]
            shape = str(part["shape"])
            size = _round(half, shape) if shape in ("cylinder", "capsule") else _box(half)
            pose = [float(each) for each in part["pose"]]
            turned = tuple(float(each) for each in xyzw(tuple(pose)))
            red, green, blue = (float(each) for each in part["color"][:3])
            found.append(DrawnPart(shape, size, (pose[0], pose[1], pose[2]), turned, (red, green, blue, 1.0)))  # type: ignore[arg-type]
    return found


def rgba_of(text: str) -> Rgba:
    """A colour such as #42a5f5."""
    red, green, blue = (int(text[place : place + 2], 16) / 255.0 for place in (1, 3, 5))
    return red, green, blue, 1.0


def _of_look(part: Mapping[str, Any], own: Rgba) -> DrawnPart:
    size = [float(each) for each in part["size"]]
    shape = str(part["shape"])
    lengths = (size[0], size[0], size[-1]) if shape in ("cylinder", "cone", "capsule") else _box(size)
    color = part.get("color") or own
    rgba = own if isinstance(color, str) else tuple(float(each) for each in (*color, 1.0)[:4])
    x, y, z = (float(each) for each in part["at"])
    qx, qy, qz, qw = (float(each) for each in part["quat"])
    mesh = unpacked(part["mesh"]) if "mesh" in part else None
    return DrawnPart(shape, lengths, (x, y, z), (qx, qy, qz, qw), rgba, mesh)  # type: ignore[arg-type]


def _round(size: Sequence[float], shape: str) -> tuple[float, float, float]:
    length = size[1] + (size[0] if shape == "capsule" else 0.0)
    return size[0], size[0], length


def _box(size: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = np.broadcast_to(size, 3).tolist()
    return x, y, z
