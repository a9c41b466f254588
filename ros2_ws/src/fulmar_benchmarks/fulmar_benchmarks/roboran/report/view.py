"""One robot at one task prepared for drawing: its results, name and colour."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fulmar_benchmarks.results import PairResult
from fulmar_benchmarks.roboran.campaign import Findings
from fulmar_benchmarks.roboran.cells import head
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import Task, load_task
from fulmar_evaluation.report.drawing import columns
from fulmar_evaluation.report.style import INK, OTHER_COLOURS

# A robot keeps its colour from plot to plot; each is readable on white and on near-black.
ROBOT_COLOURS = {"floating_platform": "#3b7ddd", "kingfisher": "#1a9e84", "turtlebot2": "#d9780f"}


@dataclass(frozen=True)
class View:
    """A pair with figures."""

    entry: dict[str, Any]  # of the document
    training: dict[str, Any]  # how the policy was made; empty for a classical controller
    outcomes: dict[str, PairResult]  # by way
    colour: str

    @property
    def label(self) -> str:
        """Name for people."""
        return head(self.entry)

    @property
    def main(self) -> PairResult:
        """What is drawn where one way is enough: the batch, if there is one."""
        return next(iter(self.outcomes.values()))

    @property
    def robot(self) -> Robot:
        """The robot."""
        return load_robot(self.entry["robot"])

    @property
    def task(self) -> Task:
        """The task."""
        return load_task(self.entry["task"])

    @property
    def dt(self) -> float:
        """Time of one control step [s]."""
        return float(self.main.about["control_dt"])


def views(findings: Findings, task: str) -> list[View]:
    """Pairs of one task that have figures: of each robot its policy, else its classical controller."""
    chosen: dict[str, View] = {}
    spare = iter(OTHER_COLOURS)
    for pair, entry in zip(findings.pairs, findings.document["pairs"], strict=True):
        outcomes = findings.outcomes[pair]
        if pair.task == task and outcomes and pair.robot not in chosen:
            colour = ROBOT_COLOURS.get(pair.robot) or next(spare)
            chosen[pair.robot] = View(entry, pair.passport, outcomes, colour)
    return list(chosen.values())


def panels(
    runs: Sequence[View], height: float, rows: int = 1, *, lines: int = 0, **options: Any
) -> tuple[Figure, np.ndarray]:
    """A figure with one column a pair, titled with its name.

    Args:
        runs: The pairs.
        height: Of the whole figure [inch].
        rows: Panels of each pair.
        lines: That `note` will write below the title.
        options: For `Figure.subplots`.

    Returns:
        The figure, and its axes of shape (rows, pairs).
    """
    figure, axes = columns(len(runs), height, rows, **options)
    for one, run in zip(axes[0], runs, strict=True):
        one.set_title(run.label, color=run.colour, fontweight="bold", loc="left", pad=5.0 + 13.0 * lines)
    return figure, axes


def note(axes: Axes, text: str) -> None:
    """Write a line between a panel and its title."""
    axes.text(0.0, 1.015, text, transform=axes.transAxes, fontsize=8.5, va="bottom", color=INK)
