"""Meshes of a robot's look: STL, binary or text, Wavefront OBJ, and binary glTF, read into triangles.

STL has triangles alone. Of OBJ the vertices (`v`) and faces (`f`) are read; colours, textures and normals are not.
"""

from __future__ import annotations

import functools
import itertools
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fulmar_core.config.bounded_file import read_bounded
from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.gltf_file import read_glb

SUFFIXES = (".stl", ".obj", ".glb")
LARGEST_BYTES = 100_000_000
MOST_TRIANGLES = 1_000_000
_HEADER, _FACET = 84, 50  # of a binary STL: header with the count, one triangle [bytes]


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles of one file.

    Attributes:
        vertices: Shape (n, 3), in the unit of the file.
        triangles: Numbers of their corners, counterclockwise seen from outside, shape (m, 3).
    """

    vertices: np.ndarray
    triangles: np.ndarray

    @property
    def span(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest corner of the bounding box, each of shape (3,)."""
        return self.vertices.min(axis=0), self.vertices.max(axis=0)


def check_mesh_file(path: Path) -> None:
    """Refuse a mesh that is missing, or of another format; its content is not read.

    Raises:
        ConfigError: One line with the path.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise ConfigError(
            f"{path}: '{path.suffix}' is no mesh that is drawn; accepted are {', '.join(SUFFIXES)}. Convert it."
        )
    if not path.is_file():
        raise ConfigError(
            f"{path}: there is no such mesh. Put the file there, or take the part out of 'look'."
        )


@functools.lru_cache(maxsize=64)
def read_mesh(path: Path) -> Mesh:
    """Read one file.

    Raises:
        ConfigError: It is missing, too large, or damaged; the message begins with the path.
    """
    check_mesh_file(path)
    try:
        data = read_bounded(path, LARGEST_BYTES)
        mesh = READERS[path.suffix.lower()](data)
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror or error}).") from error
    except (ValueError, LookupError, TypeError, OverflowError, AttributeError) as error:
        said = f"{type(error).__name__} {error}" if isinstance(error, LookupError) else error
        raise ConfigError(f"{path}: is no whole {path.suffix[1:].upper()} file: {said}.") from error
    if not len(mesh.triangles) or not np.isfinite(mesh.vertices).all():
        raise ConfigError(f"{path}: has no triangles, or vertices that are not finite.")
    if len(mesh.triangles) > MOST_TRIANGLES:
        raise ConfigError(
            f"{path}: has {len(mesh.triangles)} triangles, at most {MOST_TRIANGLES}. Decimate it."
        )
    return mesh


def _stl(data: bytes) -> Mesh:
    """A binary STL says how many triangles it has, and is exactly so long; anything else is text."""
    if len(data) >= _HEADER:
        count = int.from_bytes(data[_HEADER - 4 : _HEADER], "little")
        if len(data) == _HEADER + _FACET * count:
            kind = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
            corners = np.frombuffer(data, kind, count, _HEADER)["corners"].astype(float)
            return _of_corners(corners.reshape(-1, 3))
        if not data.lstrip().startswith(b"solid"):
            raise ValueError(
                f"{count} triangles take {_HEADER + _FACET * count} bytes, and it has {len(data)}"
            )
    rows = [line.split()[1:4] for line in data.splitlines() if line.split()[:1] == [b"vertex"]]
    if not rows or len(rows) % 3:
        raise ValueError(f"{len(rows)} vertices are no triangles")
    return _of_corners(np.array(rows, dtype=float))


def _of_corners(corners: np.ndarray) -> Mesh:
    """Triangles of which each has three corners of its own; equal ones become one vertex."""
    vertices, numbers = np.unique(corners, axis=0, return_inverse=True)
    return Mesh(vertices, numbers.reshape(-1, 3))


def _obj(data: bytes) -> Mesh:
    """Faces of more than three corners become fans of triangles; negative numbers count from the last vertex."""
    vertices: list[list[float]] = []
    triangles: list[tuple[int, int, int]] = []
    for line in data.decode("utf-8", "replace").splitlines():
        kind, *words = line.split() or [""]
        if kind == "v":
            vertices.append([float(word) for word in words[:3]])
        elif kind == "f":
            numbers = [int(word.split("/")[0]) for word in words]
            corners = [number - 1 if number > 0 else len(vertices) + number for number in numbers]
            triangles += [(corners[0], *pair) for pair in itertools.pairwise(corners[1:])]
    table = np.array(vertices, dtype=float).reshape(-1, 3)
    found = np.array(triangles, dtype=int).reshape(-1, 3)
    if len(found) and not (found.min() >= 0 and found.max() < len(table)):
        raise ValueError("a face names a vertex that is not there")
    return Mesh(table, found)


def _glb(data: bytes) -> Mesh:
    return Mesh(*read_glb(data))


READERS = {".stl": _stl, ".obj": _obj, ".glb": _glb}
