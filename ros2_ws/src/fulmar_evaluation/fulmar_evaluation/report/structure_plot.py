"""Outlines of things in space, and of their keep-out volumes, as they look from a side."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon

from fulmar_core.worlds.structures import Structure
from fulmar_evaluation.report.style import DASHED, INK

FAINT = 0.15  # opacity of a part
BEYOND_SLOPE = 1e-12  # of a turn that counts as one [m²]


def draw_structures(axes: Axes, structures: Sequence[Structure], columns: list[int]) -> None:
    """Draw parts as the outlines of the boxes about them, and keep-out volumes as dashed outlines.

    Args:
        axes: Where.
        structures: What, in the world.
        columns: Which of x, y, z go to the right and up.
    """
    for structure in structures:
        for part in structure.parts:
            shape = outline(part.corners[:, columns])
            axes.add_patch(
                Polygon(shape, facecolor=(*part.color, FAINT), edgecolor=(INK, 0.35), linewidth=0.5, zorder=1)
            )
        volume = structure.keep_out
        ends = {tuple(np.array(end)[columns]) for end in (volume.start, volume.end)}
        for end in ends:
            axes.add_patch(Circle(end, volume.radius, fill=False, ls=DASHED, ec=(INK, 0.5), lw=0.8, zorder=1))


def reach_of(structures: Sequence[Structure]) -> np.ndarray:
    """Corners of boxes about keep-out volumes, shape (n, 3) [m]; n is 0 without any."""
    volumes = [structure.keep_out for structure in structures]
    ends = [np.array(end) + side * v.radius for v in volumes for end in (v.start, v.end) for side in (-1, 1)]
    return np.array(ends).reshape(-1, 3)


def outline(points: np.ndarray) -> np.ndarray:
    """Corners of the convex hull of points (n, 2), in their order (Andrew's monotone chain), shape (k, 2)."""
    ordered = np.unique(points.round(9), axis=0)
    chains = []
    for way in (ordered, ordered[::-1]):
        chain: list[np.ndarray] = []
        for point in way:
            while len(chain) > 1 and _turn(chain[-2], chain[-1], point) <= BEYOND_SLOPE:
                chain.pop()
            chain.append(point)
        chains += chain[:-1]
    return np.array(chains)


def _turn(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    """Positive where the way from a over b to c turns to the left."""
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
