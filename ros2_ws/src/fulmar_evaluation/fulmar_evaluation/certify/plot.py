"""Figure of a certified set: pairs of axes, where episodes succeeded, and where the set ends."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from fulmar_core.safety.certified_set import Axis, CertifiedSet
from fulmar_evaluation.certify.procedure import Result
from fulmar_evaluation.report.drawing import columns
from fulmar_evaluation.report.style import PAPER, house_style

PAIRS = 6  # of the axes that end the set soonest
CELLS = 24  # of each panel's grid of predicted success


def write_plot(found: dict[str, Any], result: Result, path: Path) -> Path:
    """Draw predicted success over pairs of axes, the others at their easiest; returns the path.

    Args:
        found: The document of a certification.
        result: What it came from.
        path: Of the image.
    """
    certified = CertifiedSet.from_plain(found, "certified set") if found["score"] else None
    axes = [Axis(**axis) for axis in found["axes"]]
    order = np.argsort(-result.fit.score(np.eye(result.fit.linear.size)))
    pairs = [(int(order[i]), int(order[j])) for i in range(len(order)) for j in range(i + 1, len(order))]
    pairs = sorted(pairs, key=lambda pair: sum(map(list(order).index, pair)))[:PAIRS]
    with house_style():
        figure, panels = columns(min(3, len(pairs)), 3.4, rows=-(-len(pairs) // 3))
        figure.patch.set_facecolor(PAPER)
        for panel, pair in zip(panels.ravel(), pairs, strict=False):
            _draw(panel, result, axes, certified, pair)
        for panel in panels.ravel()[len(pairs) :]:
            panel.set_visible(False)
        end = "black: end of the certified set; dashed: its box" if certified else "no certified set"
        figure.suptitle(f"{found['robot']}, {found['task']}: predicted success; {end}")
        figure.savefig(path)
    return path


def _draw(
    panel: Axes, result: Result, axes: list[Axis], certified: CertifiedSet | None, pair: tuple[int, int]
) -> None:
    """One pair of axes: success by colour, the end of the set, and its box."""
    first, second = pair
    grid = np.linspace(0.0, 1.0, CELLS)
    across, along = np.meshgrid(grid, grid)
    shares = np.zeros((CELLS, CELLS, result.fit.linear.size))
    shares[..., first], shares[..., second] = across, along
    flat = shares.reshape(-1, shares.shape[-1])
    success = result.fit.success(flat).reshape(across.shape)
    one, other = axes[first], axes[second]
    x = one.low + (one.high - one.low) * across
    y = other.low + (other.high - other.low) * along
    panel.set_xlabel(f"{one.name} [{one.unit}]")
    panel.set_ylabel(f"{other.name} [{other.unit}]")
    if certified is not None:
        score = certified.score(flat).reshape(across.shape)
        panel.contour(x, y, score, levels=[certified.threshold], colors="black")
        corner_x, corner_y = certified.box[one.name][1], certified.box[other.name][1]
        panel.plot([one.low, corner_x, corner_x], [corner_y, corner_y, other.low], "--", color="black")
    panel.contourf(x, y, success, levels=[0.0, 0.5, 0.8, 0.9, 0.95, 0.99, 1.0], cmap="RdYlGn", zorder=0)
