"""Where success fails: a map over what episodes begin with."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from fulmar_benchmarks.roboran.report.view import View, panels, told
from fulmar_benchmarks.unit import map_axes
from fulmar_evaluation.report.style import ALARM, FAINT

BINS = 8  # along each axis
FEWEST = 4  # episodes in a field that is drawn
_LEAST_SCALE = 5.0  # [%]


def draw_map(runs: Sequence[View]) -> Figure:
    """Share of failed episodes, or the mean share of the bound, in fields of a map."""
    shares = "share_of_bound" in runs[0].main.figures
    figure, axes = panels(runs, 3.4, lines=1, sharey=True)
    drawn = [_fields(run, shares) for run in runs]
    known = np.concatenate([field[np.isfinite(field)] for _, _, field in drawn])
    top = 100.0 if shares else max(_LEAST_SCALE, float(known.max(initial=0.0)))
    colours = _colours(shares)
    for one, run, (x, y, field) in zip(axes[0], runs, drawn, strict=True):
        mesh = one.pcolormesh(x, y, field.T, cmap=colours, vmin=0.0, vmax=top, rasterized=False)
        mesh.set_edgecolor("face")
        one.set_facecolor("none")
        one.set_xlabel(map_axes(run.entry["task"])[0])
        one.tick_params(length=3.0)
        told(one, _told(run, shares))
    vertical = map_axes(runs[0].entry["task"])[1]
    axes[0, 0].set_ylabel(vertical)
    if "bearing" in vertical:
        axes[0, 0].set_yticks((-180, -90, 0, 90, 180))
    bar = figure.colorbar(mesh, ax=list(axes[0]), pad=0.02, aspect=18)
    bar.set_label("mean share of the bound [%]" if shares else "failed episodes [%]")
    bar.outline.set_edgecolor(FAINT)
    return figure


def _colours(shares: bool) -> LinearSegmentedColormap:
    """From nothing to alarm; for shares of a bound the other way round."""
    stops = ["#e9eef5", "#f4b6c8", ALARM, "#7a1237"]
    return LinearSegmentedColormap.from_list("fields", list(reversed(stops)) if shares else stops)


def _fields(run: View, shares: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Edges of the fields, and percent in each, NaN where too few episodes are."""
    outcome = run.main
    x, y = outcome.map_xy.T
    values = outcome.figures["share_of_bound"] if shares else 1.0 - outcome.succeeded
    low, high = np.min(outcome.map_xy, axis=0), np.max(outcome.map_xy, axis=0)
    edges = [np.linspace(a, max(b, a + 1e-6), BINS + 1) for a, b in zip(low, high, strict=True)]
    count, _, _ = np.histogram2d(x, y, bins=edges)
    total, _, _ = np.histogram2d(x, y, bins=edges, weights=np.nan_to_num(values))
    return edges[0], edges[1], np.where(count >= FEWEST, 100.0 * total / np.maximum(count, 1.0), np.nan)


def _told(run: View, shares: bool) -> str:
    outcome = run.main
    if shares:
        return f"mean {100.0 * float(np.nanmean(outcome.figures['share_of_bound'])):.0f} %"
    failed = int(np.count_nonzero(~outcome.succeeded))
    return f"{failed:,} of {len(outcome.succeeded):,} failed"
