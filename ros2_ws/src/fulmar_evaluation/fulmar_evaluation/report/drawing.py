"""Drawing functions that every report shares: scales, bands over time, robots and goals seen from above."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Polygon
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullLocator

from fulmar_core.robots.robot import Body
from fulmar_core.tasks.terms import Tolerance
from fulmar_evaluation.report.style import DASHED, FAINT, INK, PAPER, READABLE, quiet_grid

WIDTH = 9.2  # of a figure that fills the page of a benchmark [inch]
LENGTHS = {0.001: "1 mm", 0.01: "1 cm", 0.1: "10 cm", 1.0: "1 m", 10.0: "10 m"}
ANGLES = {0.01: "0.01°", 0.1: "0.1°", 1.0: "1°", 10.0: "10°", 100.0: "100°"}


def columns(count: int, height: float, rows: int = 1, **options: Any) -> tuple[Figure, np.ndarray]:
    """A figure with so many columns, as wide as they need.

    Args:
        count: Columns, >= 1.
        height: Of the whole figure [inch].
        rows: Panels of each column.
        options: For `Figure.subplots`.

    Returns:
        The figure, and its axes of shape (rows, count).
    """
    figure = Figure(figsize=(WIDTH * min(1.0, (count + 0.4) / 3.4), height), layout="constrained")
    return figure, figure.subplots(rows, count, squeeze=False, **options)


def log_scale(axis: Axis, marks: dict[float, str] | Sequence[float]) -> None:
    """Make a scale logarithmic, with labels at some values only.

    Args:
        axis: `axes.xaxis` or `axes.yaxis`.
        marks: The values, with their labels where these are more than the number.
    """
    labels = marks if isinstance(marks, dict) else {value: f"{value:g}" for value in marks}
    axes = axis.axes
    (axes.set_xscale if axis is axes.xaxis else axes.set_yscale)("log")
    axis.set_major_locator(FixedLocator(list(labels)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: labels.get(value, "")))
    axis.set_minor_locator(NullLocator())


def share_axis(axes: Axes, ticks: MaxNLocator) -> None:
    """A horizontal axis of shares in percent over rows with names of their own."""
    axes.xaxis.set_major_locator(ticks)
    axes.xaxis.set_major_formatter(lambda value, _: f"{100.0 * value:.0f} %")
    quiet_grid(axes)
    axes.grid(False, axis="y")
    axes.spines["left"].set_visible(False)
    axes.tick_params(axis="y", length=0.0)


def limit_line(axes: Axes, value: float, label: str = "") -> None:
    """A dashed line at a tolerance, with its name above it."""
    axes.axhline(value, color=INK, linestyle=DASHED, linewidth=1.0)
    look = {"va": "bottom", "fontsize": 8.5, "color": INK, "bbox": READABLE}
    axes.text(0.005, value, label, transform=axes.get_yaxis_transform(), **look)


def bands(axes: Axes, time_s: np.ndarray, quantiles: np.ndarray, colour: str, *, half: bool = True) -> None:
    """The median over time, with the bands of nine in ten and, with `half`, of the middle half.

    Args:
        axes: Where.
        time_s: Shape (n,) [s].
        quantiles: 5, 25, 50, 75 and 95 %, shape (5, n).
        colour: Of all.
        half: Whether to draw the inner band.
    """
    low, lower, middle, upper, high = quantiles
    axes.fill_between(time_s, low, high, color=colour, alpha=0.13, linewidth=0)
    if half:
        axes.fill_between(time_s, lower, upper, color=colour, alpha=0.22, linewidth=0)
    axes.plot(time_s, middle, color=colour, linewidth=1.5 if half else 1.1)


def spaced(xy: np.ndarray, count: int) -> np.ndarray:
    """Indices of at most so many samples, evenly spaced along a path of shape (n, 2)."""
    length = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(xy, axis=0), axis=1))))
    return np.unique(np.searchsorted(length, np.linspace(0.0, length[-1], count)).clip(0, len(xy) - 1))


def draw_body(axes: Axes, pose: np.ndarray, body: Body, colour: str) -> None:
    """The outline of a robot at a pose (x [m], y [m], yaw [rad]), with a stroke to where it is heading."""
    x, y, yaw = pose
    ahead = np.array((np.cos(yaw), np.sin(yaw)))
    look: dict[str, Any] = {"facecolor": (colour, 0.1), "edgecolor": (colour, 0.6), "linewidth": 0.9}
    if body.footprint is None:
        axes.add_patch(Circle((x, y), body.radius, **look, zorder=3))
        nose = body.radius
    else:
        half_length, half_width = 0.5 * body.footprint[0], 0.5 * body.footprint[1]
        front, back = body.footprint_x + half_length, body.footprint_x - half_length
        corners = [(front, half_width), (back, half_width), (back, -half_width), (front, -half_width)]
        turn = np.array((ahead, (-ahead[1], ahead[0])))
        axes.add_patch(Polygon(np.array(corners) @ turn + (x, y), **look, zorder=3))
        nose = front
    axes.plot(*np.stack(((x, y), (x, y) + nose * ahead)).T, color=colour, linewidth=1.2, alpha=0.8, zorder=3)


def draw_goal(axes: Axes, goal: np.ndarray, tolerance: Tolerance, *, arrow: float, edge: str = INK) -> None:
    """A goal (x [m], y [m], yaw [rad]) as large as its tolerance, with an arrow where a heading is asked for [m]."""
    x, y, yaw = goal
    axes.add_patch(
        Circle((x, y), tolerance.position, facecolor=PAPER, edgecolor=edge, linewidth=1.0, zorder=6)
    )
    if arrow and tolerance.heading_deg > 0.0:
        tip = (x + arrow * np.cos(yaw), y + arrow * np.sin(yaw))
        axes.plot(*tip, linestyle="none")  # makes room: arrows beyond the axes are not drawn
        look = {"arrowstyle": "-|>", "color": INK, "linewidth": 1.1, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", tip, (x, y), arrowprops=look, zorder=7)


def draw_discs(axes: Axes, discs: Iterable[np.ndarray]) -> None:
    """Obstacles (x, y, radius [m], whatever else); a radius of 0 is none."""
    for x, y, radius, *_ in discs:
        if radius > 0.0:
            axes.add_patch(Circle((x, y), radius, facecolor=FAINT, alpha=0.55, linewidth=0, zorder=2))


def key(figure: Figure, handles: Sequence[Line2D], most: int = 6) -> None:
    """A legend above the whole figure."""
    figure.legend(handles=handles, loc="outside upper left", ncols=min(len(handles), most), fontsize=9)


def colour_lines(colours: dict[str, str]) -> list[Line2D]:
    """Legend entries of lines, by label and colour."""
    return [Line2D([], [], color=colour, label=label) for label, colour in colours.items()]


def ring(colour: str = INK, **look: Any) -> dict[str, Any]:
    """How a value of others is marked: a circle that is not filled."""
    return {"linestyle": "", "marker": "o", "color": colour, "markerfacecolor": "none", **look}
