"""Shapes of things in space, and of the volumes about them to keep out of."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from fulmar_core.states.rotation import rotate
from fulmar_core.worlds.structures import KeepOut, Part, Structure, xyzw
from fulmar_ros.scene.shape import Color, Kind, Shape

UPRIGHT = np.array((0.0, 0.0, 0.0, 1.0))
THING, KEEP_OUT = "thing", "keep_out"
WITHIN: Color = (0.9, 0.1, 0.1, 0.08)  # so faint that what stands in the volume stays visible


def structure_shapes(structures: Sequence[Structure]) -> list[Shape]:
    """Each part of some structures, and their keep-out volumes."""
    parts = [shape for structure in structures for part in structure.parts for shape in _part(part)]
    volumes = [shape for structure in structures for shape in _volume(structure.keep_out)]
    return [replace(shape, number=i) for group in (parts, volumes) for i, shape in enumerate(group)]


def _part(part: Part) -> Iterator[Shape]:
    kind: Kind = "cylinder" if part.shape == "capsule" else part.shape
    size, quat = part.half_box, xyzw(part.pose)
    if part.shape == "capsule":
        radius, half = part.size
        size = np.array((radius, radius, half))
        for end in (-half, half):
            at = np.array(part.pose[:3]) + rotate(quat, np.array((0.0, 0.0, end)))
            yield _shape(THING, "sphere", np.full(3, radius), at, (*part.color, 1.0))
    yield _shape(THING, kind, size, np.array(part.pose[:3]), (*part.color, 1.0), quat)


def _volume(volume: KeepOut) -> Iterator[Shape]:
    """Two balls and what lies between them; one ball where it is one."""
    start, end, radius = np.array(volume.start), np.array(volume.end), volume.radius
    yield _shape(KEEP_OUT, "sphere", np.full(3, radius), start, WITHIN)
    length = float(np.linalg.norm(end - start))
    if length > 0.0:
        yield _shape(KEEP_OUT, "sphere", np.full(3, radius), end, WITHIN)
        x, y, z = (end - start) / length  # the shortest turn of the z axis into this one
        quat = np.array((-y, x, 0.0, 1.0 + z)) if z > -1.0 else np.array((1.0, 0.0, 0.0, 0.0))
        size = np.array((radius, radius, 0.5 * length))
        yield _shape(KEEP_OUT, "cylinder", size, 0.5 * (start + end), WITHIN, quat / np.linalg.norm(quat))


def _shape(
    group: str, kind: Kind, half: np.ndarray, at: np.ndarray, color: Color, quat: np.ndarray = UPRIGHT
) -> Shape:
    x, y, z = (2.0 * float(part) for part in half)
    qx, qy, qz, qw = quat.tolist()
    return Shape(group, 0, kind, False, (x, y, z), color, tuple(at.tolist()), quat=(qx, qy, qz, qw))
