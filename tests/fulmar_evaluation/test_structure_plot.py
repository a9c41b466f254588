"""Things in space in the plots of a report: where their outlines lie."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from fulmar_core.worlds.structures import list_structures, load_structure
from fulmar_evaluation.report.structure_plot import draw_structures, outline, reach_of


def test_an_outline_has_the_corners_of_its_points_in_order_and_nothing_within() -> None:
    square = np.array([[0, 0], [2, 0], [2, 1], [0, 1], [1, 0.5], [1, 0], [0, 0]], dtype=float)
    found = outline(square)
    assert found.tolist() == [[0, 0], [2, 0], [2, 1], [0, 1]]


@pytest.mark.parametrize("name", list_structures())
def test_both_views_show_every_part_within_the_keep_out_volume(name: str) -> None:
    structure = load_structure(name)
    for columns in ([0, 1], [0, 2]):
        axes = Figure().subplots()
        draw_structures(axes, [structure], columns)
        parts = [patch for patch in axes.patches if isinstance(patch, Polygon)]
        (volume,) = [patch for patch in axes.patches if isinstance(patch, Circle)]
        assert len(parts) == len(structure.parts)
        corners = np.concatenate([part.get_xy() for part in parts])
        assert np.linalg.norm(corners - volume.center, axis=1).max() < volume.radius
    np.testing.assert_allclose(np.abs(reach_of([structure])), structure.keep_out.radius)
    assert reach_of([]).shape == (0, 3)
