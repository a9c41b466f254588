"""Single episodes seen from above: obstacles to go around, waypoints to go through."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from fulmar_benchmarks.roboran.report.view import View, panels, told
from fulmar_evaluation.report.style import ALARM, FAINT, INK, PAPER, quiet_grid

OUTLINES = 7  # of the body along a way
MARGIN = 0.8  # around what is shown [m]
AWAY = 3.0  # from what stands about that a way is followed: who is lost must not make all else small [m]


def draw_scenes_with_obstacles(runs: Sequence[View]) -> Figure:
    """Of every pair an episode that went well, and one that did not where there is one."""
    figure, axes = panels(runs, 6.4, rows=2, lines=1)
    for column, run in enumerate(runs):
        for one, episode in zip(axes[:, column], _two_episodes(run), strict=True):
            outcome = run.main
            well = bool(outcome.succeeded[episode])
            for x, y, radius, *_ in outcome.obstacles[episode]:
                if radius > 0.0:
                    one.add_patch(Circle((x, y), radius, facecolor=FAINT, edgecolor=INK, linewidth=0.6))
            _way(one, run, episode, run.colour if well else ALARM)
            goal = outcome.targets[episode, 0]
            one.add_patch(
                Circle(tuple(goal[:2]), run.task.tolerance.position, facecolor=PAPER, edgecolor=INK, zorder=6)
            )
            _name(one, goal, "goal")
            told(one, f"episode {episode}: {'reached, nothing touched' if well else _fault(run, episode)}")
            _finish(one, run, episode)
    for one in axes[:, 0]:
        one.set_ylabel("y [m]")
    return figure


def draw_courses(runs: Sequence[View]) -> Figure:
    """Of every pair the episode whose share of the bound is nearest to the median."""
    figure, axes = panels(runs, 3.8, lines=1)
    for one, run in zip(axes[0], runs, strict=True):
        outcome = run.main
        shares = outcome.figures.get("share_of_bound", outcome.figures["goals_reached"])
        kept = shares[: len(outcome.paths)]
        episode = int(np.nanargmin(np.abs(kept - np.nanmedian(shares))))
        places = outcome.targets[episode, :, :2]
        loop = np.concatenate((places, places[:1]))
        one.plot(*loop.T, color=FAINT, linewidth=0.8, linestyle=(0, (4, 3)), zorder=2)
        done = int(outcome.goals[episode, -1])
        for index, (x, y) in enumerate(places):
            one.add_patch(
                Circle(
                    (x, y),
                    run.task.tolerance.position,
                    facecolor=PAPER,
                    edgecolor=run.colour if index < done else FAINT,
                    linewidth=1.2,
                    zorder=6,
                )
            )
            one.text(x, y, str(index + 1), ha="center", va="center", fontsize=7, zorder=7)
        _way(one, run, episode, run.colour)
        most = outcome.figures.get("goals_bound")
        told(one, f"{done} reached" if most is None else f"{done} reached, bound {int(most[episode])}")
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
    length = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(way[:, :2], axis=0), axis=1))))
    instants = np.searchsorted(length, np.linspace(0.0, length[-1], OUTLINES)).clip(0, len(way) - 1)
    for x, y, yaw in way[np.unique(instants)]:
        _outline(axes, run, x, y, yaw, colour)
    _name(axes, way[0], "start")


def _outline(axes: Axes, run: View, x: float, y: float, yaw: float, colour: str) -> None:
    body = run.robot.body
    look = {"facecolor": colour, "alpha": 0.13, "zorder": 3}
    if body.footprint is None:
        axes.add_patch(Circle((x, y), body.radius, **look))
        nose = body.radius
    else:
        ahead, aside = 0.5 * body.footprint[0], 0.5 * body.footprint[1]
        corners = np.array([(ahead, aside), (-ahead, aside), (-ahead, -aside), (ahead, -aside)])
        turn = np.array([(np.cos(yaw), np.sin(yaw)), (-np.sin(yaw), np.cos(yaw))])
        axes.add_patch(Polygon(corners @ turn + (x, y), **look))
        nose = ahead
    axes.plot(
        (x, x + nose * np.cos(yaw)),
        (y, y + nose * np.sin(yaw)),
        color=colour,
        linewidth=1.0,
        alpha=0.7,
        zorder=5,
    )


def _name(axes: Axes, place: np.ndarray, text: str) -> None:
    axes.annotate(
        text,
        (place[0], place[1]),
        (0, -13),
        textcoords="offset points",
        ha="center",
        fontsize=8.5,
        bbox={"facecolor": PAPER, "edgecolor": "none", "alpha": 0.75, "pad": 0.8},
        zorder=8,
    )


def _finish(axes: Axes, run: View, episode: int) -> None:
    """Show what stands about, and the way, unless it leads far away."""
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
