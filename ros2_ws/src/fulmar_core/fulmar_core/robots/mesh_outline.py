"""Meshes of a look with few triangles, as they travel in `robot_info`: to the page, to videos and to exports."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_core.robots.look import Part
from fulmar_core.robots.mesh_file import Mesh, read_mesh

MOST_TRIANGLES = 3000  # of all meshes of a robot, about 50 kB of JSON; our value
FEWEST = 12  # triangles, those of a box
FINEST = 96  # cells along the longest side that corners are gathered in, at first; our value
COARSER = 0.8  # of the number of cells from one trial to the next
POINT, CORNER = "<f4", "<u2"  # a coordinate [m], the number of a point


def outline_of(part: Part, most: int) -> Mesh:
    """A mesh in metres about the part's origin, with few triangles.

    Corners that share a cell of a grid become one, at their mean (vertex clustering: Rossignac and Borrel 1993,
    "Multi-resolution 3D approximations for rendering complex scenes"); the grid grows coarser until few are left.

    Args:
        part: Of shape `mesh`.
        most: Triangles; `FEWEST` are kept in any case.

    Raises:
        ConfigError: The file cannot be read.
    """
    whole = read_mesh(Path(part.file))
    scale = np.array(part.scale)
    # A mirrored triangle is seen from behind, unless its corners change sides.
    triangles = whole.triangles if scale.prod() > 0.0 else whole.triangles[:, ::-1]
    mesh = Mesh(whole.vertices * scale, triangles)
    cells = FINEST
    while len(mesh.triangles) > max(most, FEWEST) and cells > 1:
        mesh = _gathered(Mesh(whole.vertices * scale, triangles), cells)
        cells = int(COARSER * cells)
    return mesh


def _gathered(mesh: Mesh, cells: int) -> Mesh:
    """The mesh whose corners are the means of those in each cell; what has become a line or a point is left out."""
    low, high = mesh.span
    side = max(float((high - low).max()) / cells, 1e-9)
    places = np.floor((mesh.vertices - low) / side).astype(int)
    _, cell = np.unique(places, axis=0, return_inverse=True)
    cell = cell.reshape(-1)
    sums = np.stack([np.bincount(cell, weights=axis) for axis in mesh.vertices.T], axis=1)
    corners = cell[mesh.triangles]
    first, second, third = corners.T
    kept = corners[(first != second) & (second != third) & (third != first)]
    _, once = np.unique(np.sort(kept, axis=1), axis=0, return_index=True)
    return Mesh(sums / np.bincount(cell)[:, None], kept[np.sort(once)])


def packed(mesh: Mesh) -> dict[str, str]:
    """Points and triangles as base64, for JSON."""
    used, corners = np.unique(mesh.triangles, return_inverse=True)
    points = mesh.vertices[used].astype(POINT)
    return {
        "points": base64.b64encode(points.tobytes()).decode(),
        "corners": base64.b64encode(corners.astype(CORNER).tobytes()).decode(),
    }


def unpacked(said: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Points, shape (n, 3) [m], and the numbers of the corners of triangles, shape (m, 3).

    Raises:
        ValueError: They are damaged.
    """
    points = np.frombuffer(base64.b64decode(said["points"]), POINT).reshape(-1, 3).astype(float)
    corners = np.frombuffer(base64.b64decode(said["corners"]), CORNER).reshape(-1, 3).astype(int)
    if corners.size and corners.max() >= len(points):
        raise ValueError(f"a mesh of {len(points)} points has a corner {corners.max()}")
    return points, corners


def share_of(parts: Sequence[Part]) -> int:
    """Triangles of each mesh, where all share the most of a robot."""
    return MOST_TRIANGLES // max(1, sum(part.shape == "mesh" for part in parts))
