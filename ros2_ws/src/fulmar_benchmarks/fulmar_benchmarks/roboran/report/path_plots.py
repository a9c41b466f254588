"""Paths seen from above: to a goal, around obstacles, through waypoints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fulmar_benchmarks.roboran.report.view import View, note, panels
from fulmar_evaluation.report.drawing import draw_body, draw_discs, draw_goal, spaced
from fulmar_evaluation.report.style import ALARM, DASHED, FAINT, PAPER, quiet_grid

HALF = 5.6  # half width of a panel with the goal in its middle [m]
OUTLINES = 7  # of the body along a path
MARGIN = 0.8  # around what is shown [m]
AWAY = 3.0  # as far beyond start, goals and obstacles a path is shown, so that a lost robot shrinks nothing else [m]


def draw_paths(runs: Sequence[View]) -> Figure:
    """The first episodes of every pair, moved so that all goals coincide; where a heading counts, turned too."""
    figure, axes = panels(runs, 4.2, lines=1, sharex=True, sharey=True)
    for one, run in zip(axes[0], runs, strict=True):
        outcome = run.main
        ways = _about_the_goal(run)
        reached = outcome.succeeded[: len(ways)]
        for way, well in zip(ways, reached, strict=True):
            colour = run.colour if well else ALARM
            one.plot(*way.T, color=colour, linewidth=0.8, alpha=0.55 if well else 0.8, zorder=3 + (not well))
            one.plot(*way[0], "o", color=colour, markersize=2.6, markeredgewidth=0.0, zorder=5)
        draw_goal(one, np.zeros(3), run.task.tolerance, arrow=0.9)
        note(one, f"{int(reached.sum())} of {len(reached)} stay at the goal")
        one.set_aspect("equal")
        one.set_xlim(-HALF, HALF)
        one.set_ylim(-HALF, HALF)
        one.set_xlabel("x from the goal [m]")
        quiet_grid(one)
    axes[0, 0].set_ylabel("y from the goal [m]")
    return figure


def _about_the_goal(run: View) -> np.ndarray:
    """Ways with the goal at the origin, shape (kept, steps + 1, 2) [m]."""
    outcome = run.main
    way = np.concatenate((outcome.starts[:, None, :2], outcome.paths[:, :, :2]), axis=1)
    offset = way - outcome.targets[:, :1, :2]
    if not run.task.tolerance.heading_deg:
        return offset
    yaw = outcome.targets[:, :1, 2]
    c, s = np.cos(yaw), np.sin(yaw)
    return np.stack((c * offset[..., 0] + s * offset[..., 1], c * offset[..., 1] - s * offset[..., 0]), -1)


def draw_scenes_with_obstacles(runs: Sequence[View]) -> Figure:
    """Of every pair an episode that went well, and one that did not where there is one."""
    figure, axes = panels(runs, 6.4, rows=2, lines=1)
    for column, run in enumerate(runs):
        for one, episode in zip(axes[:, column], _two_episodes(run), strict=True):
            outcome = run.main
            well = bool(outcome.succeeded[episode])
            draw_discs(one, outcome.obstacles[episode])
            _way(one, run, episode, run.colour if well else ALARM)
            goal = outcome.targets[episode, 0]
            draw_goal(one, goal, run.task.tolerance, arrow=0.0)
            _name(one, goal, "goal")
            note(one, f"episode {episode}: {'reached, nothing touched' if well else _fault(run, episode)}")
            _finish(one, run, episode)
    for one in axes[:, 0]:
        one.set_ylabel("y [m]")
    return figure


def draw_waypoint_paths(runs: Sequence[View]) -> Figure:
    """Of every pair the episode whose share of the bound is nearest to the median."""
    figure, axes = panels(runs, 3.8, lines=1)
    for one, run in zip(axes[0], runs, strict=True):
        outcome = run.main
        shares = outcome.figures.get("share_of_bound", outcome.figures["goals_reached"])
        kept = shares[: len(outcome.paths)]
        episode = int(np.nanargmin(np.abs(kept - np.nanmedian(shares))))
        places = outcome.targets[episode, :, :2]
        loop = np.concatenate((places, places[:1]))
        one.plot(*loop.T, color=FAINT, linewidth=0.8, linestyle=DASHED, zorder=2)
        done = int(outcome.goals[episode, -1])
        for index, (x, y) in enumerate(places):
            edge = run.colour if index < done else FAINT
            draw_goal(one, np.array((x, y, 0.0)), run.task.tolerance, arrow=0.0, edge=edge)
            one.text(x, y, str(index + 1), ha="center", va="center", fontsize=7, zorder=7)
        _way(one, run, episode, run.colour)
        most = outcome.figures.get("goals_bound")
        note(one, f"{done} reached" if most is None else f"{done} reached, bound {int(most[episode])}")
        _finish(one, run, episode)
    axes[0, 0].set_ylabel("y [m]")
    return figure


def _two_episodes(run: View) -> tuple[int, int]:
    """The one with most obstacles that went well, and the first that did not, or another good one."""
    outcome = run.main
    count = np.count_nonzero(outcome.obstacles[..., 2], axis=1)
    well = outcome.succeeded[: len(count)]
    order = np.argsort(-count, kind="stable")
    good, bad = order[well[order]], order[~well[order]]
    ranked = [*good[:1], *bad[:1], *good[1:], *bad[1:], *order]
    return int(ranked[0]), int(ranked[1] if len(ranked) > 1 else ranked[0])


def _fault(run: View, episode: int) -> str:
    return "touched" if run.main.figures["collided"][episode] else "not at the goal"


def _way(axes: Axes, run: View, episode: int, colour: str) -> None:
    outcome = run.main
    way = np.concatenate((outcome.starts[episode, None], outcome.paths[episode]))
    axes.plot(*way[:, :2].T, color=colour, linewidth=1.4, zorder=4)
    for index in spaced(way[:, :2], OUTLINES):
        draw_body(axes, way[index], run.robot.body, colour)
    _name(axes, way[0], "start")


def _name(axes: Axes, place: np.ndarray, text: str) -> None:
    box = {"facecolor": PAPER, "edgecolor": "none", "alpha": 0.75, "pad": 0.8}
    look: dict[str, Any] = {"ha": "center", "fontsize": 8.5, "bbox": box, "zorder": 8}
    axes.annotate(text, (place[0], place[1]), (0, -13), textcoords="offset points", **look)


def _finish(axes: Axes, run: View, episode: int) -> None:
    """Show obstacles and targets, and the path, unless it leads far away."""
    outcome = run.main
    there = outcome.obstacles[episode][outcome.obstacles[episode][:, 2] > 0.0, :2]
    places = np.concatenate((outcome.starts[episode, None, :2], outcome.targets[episode, :, :2], there))
    way = outcome.paths[episode, :, :2].clip(places.min(axis=0) - AWAY, places.max(axis=0) + AWAY)
    places = np.concatenate((places, way))
    low, high = places.min(axis=0) - MARGIN, places.max(axis=0) + MARGIN
    half = 0.5 * float(np.max(high - low))
    middle = 0.5 * (low + high)
    axes.set_xlim(middle[0] - half, middle[0] + half)
    axes.set_ylim(middle[1] - half, middle[1] + half)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    quiet_grid(axes)
