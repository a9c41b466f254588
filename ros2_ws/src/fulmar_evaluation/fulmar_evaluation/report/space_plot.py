"""The path of a body in space, from above and from the side at one scale, and a close look at the goal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

from fulmar_core.states.rotation import rotate
from fulmar_evaluation.report.drawing import colour_lines, spaced
from fulmar_evaluation.report.run_view import View, evaluated
from fulmar_evaluation.report.structure_plot import draw_structures, reach_of
from fulmar_evaluation.report.style import BODY_AXES, DASHED, INK, PAPER, quiet_grid
from fulmar_evaluation.report.trajectory_plot import (
    OUTLINES,
    draw_near,
    draw_waypoints,
    given_targets,
    has_place,
)
from fulmar_evaluation.run_evaluation import RunResult

PANEL = 2.5  # width of one of the two views on a page [inch]
NEAR = 1.9  # height of the close looks [inch]
FLATTEST, TALLEST = 0.5, 1.3  # height of a view over its width


@dataclass(frozen=True)
class Side:
    """One way to look at space."""

    name: str
    axes: tuple[int, int]  # which of x, y, z go to the right and up

    @property
    def title(self) -> str:
        """Its name, with the letters of the two axes."""
        return f"{self.name} ({', '.join(self.labels)})"

    @property
    def labels(self) -> tuple[str, str]:
        """Letters of the two axes."""
        return "xyz"[self.axes[0]], "xyz"[self.axes[1]]


SIDES = (Side("from above", (0, 1)), Side("from the side", (0, 2)))


def draw_space(figure: Figure | SubFigure, runs: Sequence[View], *, stacked: bool = False) -> bool:
    """Both views, and where the goal is a place, both close looks below them.

    Args:
        figure: Where.
        runs: What; at least one has a result.
        stacked: Put the views below one another where there are no close looks.

    Returns:
        Whether there are close looks.
    """
    near = any(has_place(result) for _, result in evaluated(runs))
    (left, right), vertical = _room(runs)
    wide, tall = right - left, float(np.max(np.diff(vertical, axis=1)))
    heights = [PANEL * tall / wide, *([NEAR] if near else [])]
    grid = (
        figure.subplots(2, 1, squeeze=False).T
        if stacked and not near
        else figure.subplots(len(heights), 2, squeeze=False, height_ratios=heights)
    )
    for side, axes, (low, high) in zip(SIDES, grid[0], vertical, strict=True):
        middle = 0.5 * (low + high)
        _path(axes, runs, side, reach=0.05 * wide)
        axes.set_xlim(left, right)
        axes.set_ylim(middle - 0.5 * tall, middle + 0.5 * tall)
        axes.set_title(side.title)
    if near:
        for side, axes in zip(SIDES, grid[1], strict=True):
            draw_near(axes, runs, side.axes)
            axes.set_xlabel(f"{side.labels[0]} from the goal [cm]")
            axes.set_ylabel(f"{side.labels[1]} [cm]")
    figure.legend(handles=_key(runs), loc="outside upper left", ncols=3 + len(runs), fontsize=8.5)
    return near


def space_height(runs: Sequence[View]) -> float:
    """Height that `draw_space` needs on a page [inch]."""
    (left, right), vertical = _room(runs)
    near = any(has_place(result) for _, result in evaluated(runs))
    shape = float(np.max(np.diff(vertical, axis=1))) / (right - left)
    return 1.1 + PANEL * shape + (NEAR + 0.5 if near else 0.0)


def _key(runs: Sequence[View]) -> list[Line2D]:
    """What the colours of runs and of a body's axes mean."""
    body = {f"body's {name}": colour for name, colour in zip("xyz", BODY_AXES, strict=True)}
    return colour_lines({run.label: run.colour for run, _ in evaluated(runs)} | body)


def _room(runs: Sequence[View]) -> tuple[tuple[float, float], np.ndarray]:
    """Limits of x, and of y and z, shape (2, 2), with room for outlines and words [m]."""
    places = np.concatenate([_places(run, result) for run, result in evaluated(runs)])
    low, high = places.min(axis=0), places.max(axis=0)
    pad = 2.7 * max(result.robot.body.radius for _, result in evaluated(runs)) + 0.06 * float(max(high - low))
    low, high = low - pad, high + pad
    wide, tall = float(high[0] - low[0]), float(max((high - low)[1:]))
    missing = 0.5 * max(0.0, tall / TALLEST - wide)
    flat = 0.5 * max(0.0, FLATTEST * wide - tall)
    vertical = np.stack((low[1:] - flat, high[1:] + flat), axis=1)
    return (float(low[0]) - missing, float(high[0]) + missing), vertical


def _places(run: View, result: RunResult) -> np.ndarray:
    """Everything that must be seen, shape (n, 3) [m]."""
    way = run.record.motion.position[result.samples]
    way = np.concatenate((way, reach_of(result.task.structures)))
    if result.counts or has_place(result):
        return np.concatenate((way, given_targets(result)[:, :3], result.targets[:, :3]))
    return way


def _path(axes: Axes, runs: Sequence[View], side: Side, *, reach: float) -> None:
    """Paths, start, targets, and the body with its axes at some instants."""
    quiet_grid(axes)
    axes.set_aspect("equal")
    columns = list(side.axes)
    structures = {each.name: each for _, result in evaluated(runs) for each in result.task.structures}
    draw_structures(axes, list(structures.values()), columns)
    for order, (run, result) in enumerate(evaluated(runs)):
        motion, radius = run.record.motion, result.robot.body.radius
        way = motion.position[result.samples]
        axes.plot(*way[:, columns].T, color=run.colour, zorder=4)
        length = max(1.4 * radius, reach)
        for index in spaced(way, OUTLINES):
            look = {"facecolor": (run.colour, 0.08), "edgecolor": (run.colour, 0.5), "linewidth": 0.8}
            axes.add_patch(Circle(tuple(way[index, columns]), radius, **look, zorder=3))
            _body_axes(axes, way[index], motion.quat_xyzw[result.samples[index]], columns, length)
        if order == 0:
            if len(result.path):
                axes.plot(*result.path[:, columns].T, color=INK, linestyle=DASHED, linewidth=0.8, zorder=5)
            seen = way[:, columns]
            above = bool(seen[0, 1] >= float(np.mean(seen[:, 1])))
            _word(axes, "start", seen[0], 1.3 * length, up=above)
        if result.counts:
            draw = partial(_target, axes, result, columns=columns, length=length)
            draw_waypoints(axes, result, draw, columns, named=order == 0)
        elif has_place(result):
            for target in given_targets(result):
                _target(axes, result, target, PAPER, columns=columns, length=1.3 * length)
            if order == 0:
                goal = result.targets[-1, columns]
                over = bool(goal[1] >= float(np.mean(np.append(seen[:, 1], goal[1]))))
                if np.linalg.norm(goal - seen[0]) < 3.0 * length:  # the two words keep apart
                    over = not above
                _word(axes, "goal", goal, 1.5 * length, up=over)
    across, up = side.labels
    axes.set_xlabel(f"{across} [m]")
    axes.set_ylabel(f"{up} [m]")


def _word(axes: Axes, text: str, place: np.ndarray, away: float, *, up: bool) -> None:
    """A word so far above a place, or below it."""
    x, y = place
    axes.text(x, y + (away if up else -away), text, ha="center", va="bottom" if up else "top", zorder=7)


def _body_axes(
    axes: Axes, place: np.ndarray, quat: np.ndarray, columns: Iterable[int], length: float, width: float = 1.2
) -> None:
    """The three axes of a body, as long as they look from here."""
    for axis, colour in zip(np.eye(3), BODY_AXES, strict=True):
        ends = np.stack((place, place + length * rotate(quat, axis)))[:, list(columns)]
        axes.plot(*ends.T, color=colour, linewidth=width, zorder=5)


def _target(
    axes: Axes, result: RunResult, target: np.ndarray, fill: str, *, columns: list[int], length: float
) -> None:
    """A target as large as its tolerance, with the wanted axes where an attitude is asked for."""
    tolerance = result.task.tolerance
    place = tuple(target[columns])
    look = {"facecolor": fill, "edgecolor": INK, "linewidth": 1.0, "zorder": 6}
    axes.add_patch(Circle(place, tolerance.position, **look))
    if tolerance.attitude_deg > 0.0:
        _body_axes(axes, target[:3], target[3:], columns, length, 0.7)
