"""The path seen from above, and a close look at the goal."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle

from fulmar_core.states.rotation import yaw_of
from fulmar_evaluation.report.drawing import draw_body, draw_discs, draw_goal, spaced
from fulmar_evaluation.report.run_view import View, evaluated
from fulmar_evaluation.report.style import DASHED, FAINT, INK, PAPER, quiet_grid
from fulmar_evaluation.run_evaluation import RunResult

OUTLINES = 5  # of the body along the path
CLOSE_UP = 2.4  # half width of the close look, in tolerances


def draw_trajectory(axes: Axes, runs: Sequence[View]) -> None:
    """Paths, start, targets, obstacles, and the outline of the body at some instants."""
    quiet_grid(axes)
    axes.set_aspect("equal")
    for order, (run, result) in enumerate(evaluated(runs)):
        motion = run.record.motion
        xy = motion.position[result.samples, :2]
        axes.plot(*xy.T, color=run.colour, label=run.label, zorder=4)
        radius = result.robot.body.radius
        for index in spaced(xy, OUTLINES):
            yaw = float(yaw_of(motion.quat_xyzw[result.samples[index]]))
            draw_body(axes, np.append(xy[index], yaw), result.robot.body, run.colour)
        if order == 0:
            _word(axes, "start", xy[0], radius, va="bottom")
            draw_discs(axes, run.record.obstacles)
        for x, y, _ in (pose.T for pose in result.things.values()):
            axes.plot(x, y, color=run.colour, linestyle=DASHED, linewidth=1.2, zorder=4)
            axes.plot(x[-1], y[-1], "s", color=run.colour, markersize=5, zorder=6)
        if order == 0 and len(result.path):
            axes.plot(*result.path.T, color=INK, linestyle=DASHED, linewidth=0.8, zorder=3)
        if result.counts:
            draw_waypoints(axes, result, partial(_waypoint, axes, result), named=order == 0)
        elif has_place(result):
            for target in given_targets(result):
                draw_goal(axes, target, result.task.tolerance, arrow=1.6 * radius)
            if order == 0:
                _word(axes, "goal", result.targets[-1, :2], -radius, va="top")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.margins(0.1)


def draw_close_up(axes: Axes, runs: Sequence[View]) -> None:
    """The last seconds around the goal, with the tolerance."""
    draw_near(axes, runs, (0, 1))
    axes.set_xlabel("from the goal [cm]")
    axes.set_title("close to the goal")


def draw_near(axes: Axes, runs: Sequence[View], columns: tuple[int, int]) -> None:
    """The last seconds around the goal, seen along one axis: `columns` of the place go to the right and up."""
    quiet_grid(axes)
    axes.set_aspect("equal")
    shown, half_cm = list(columns), 15.0
    for run, result in evaluated(runs):
        tolerance_cm = 100.0 * result.task.tolerance.position
        half_cm = CLOSE_UP * tolerance_cm
        places = run.record.motion.position[result.samples]
        if result.task.subject in result.things:
            places = result.things[result.task.subject]
        centre = result.aims[:, shown] if result.target_moves else result.targets[-1, shown]
        x, y = 100.0 * (places[:, shown] - centre).T
        late = result.time_s >= result.window_start_s
        axes.plot(x, y, color=run.colour, linewidth=1.0, alpha=0.35)
        axes.plot(x[late], y[late], color=run.colour, linewidth=1.8)
        axes.plot(x[-1], y[-1], "o", color=run.colour, markersize=5, markeredgecolor=PAPER, zorder=5)
        axes.add_patch(Circle((0, 0), tolerance_cm, fill=False, color=INK, linestyle=DASHED, linewidth=1.0))
    axes.plot(0, 0, "+", color=INK, markersize=9)
    axes.set_xlim(-half_cm, half_cm)
    axes.set_ylim(-half_cm, half_cm)


def has_place(result: RunResult) -> bool:
    """Whether the goal is one place in the world, within a tolerance; that of an attitude is none."""
    return result.task.goal_topic in ("goal_pose", "goal_point") and result.task.tolerance.position > 0.0


def _word(axes: Axes, text: str, place: np.ndarray, away: float, *, va: str) -> None:
    """A word so far above a place, or below it, with room for it within the axes."""
    x, y = place
    axes.text(x, y + 1.15 * away, text, ha="center", va=va)
    axes.plot(x, y + 1.5 * away, linestyle="none")


def draw_waypoints(
    axes: Axes,
    result: RunResult,
    draw: Callable[[np.ndarray, str], None],
    columns: Sequence[int] = (0, 1),
    *,
    named: bool,
) -> None:
    """Every waypoint with its number; those that were reached are filled. `draw` takes a target and its colour."""
    reached, shown = int(result.run.goals[0, -1]), list(columns)
    axes.plot(*result.targets[:, shown].T, color=FAINT, linestyle=DASHED, linewidth=0.7, zorder=1)
    for number, target in enumerate(result.targets, start=1):
        draw(target, FAINT if number <= reached else PAPER)
        if named:
            place, offset = tuple(target[shown]), {"xytext": (5, 5), "textcoords": "offset points"}
            axes.annotate(str(number), place, **offset, fontsize=8, zorder=7)


def _waypoint(axes: Axes, result: RunResult, target: np.ndarray, fill: str) -> None:
    """A circle as large as the tolerance, with a stroke where a heading is asked for."""
    (x, y, yaw), radius = target, result.task.tolerance.position
    axes.add_patch(Circle((x, y), radius, facecolor=fill, edgecolor=INK, linewidth=1.0, zorder=6))
    if result.task.tolerance.heading_deg > 0.0:
        tip = np.array([x + 2.5 * radius * np.cos(yaw), y + 2.5 * radius * np.sin(yaw)])
        axes.plot([x, tip[0]], [y, tip[1]], color=INK, linewidth=1.0, zorder=6)


def given_targets(result: RunResult) -> np.ndarray:
    """Every target that was a goal at some time, in their order, shape (k, 3) or (k, 7); of one that moves the last."""
    if result.target_moves:
        return result.targets[-1:]
    changed = np.any(np.diff(result.aims, axis=0, prepend=np.nan) != 0.0, axis=1)
    return result.aims[changed]
