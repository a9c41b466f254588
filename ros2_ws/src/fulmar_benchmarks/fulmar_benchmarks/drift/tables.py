"""The document as tables in a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from fulmar_benchmarks.cells import BAD, GOOD, wide
from fulmar_benchmarks.drift.cells import (
    PATH_HEADS,
    Cell,
    Line,
    missing,
    path_lines,
    pose_heads,
    pose_lines,
    unmet,
)
from fulmar_benchmarks.drift.conditions import PATH_EPISODE_S, PATH_EPISODES, RUN_UP_S
from fulmar_benchmarks.drift.targets import BANDS

_MARKS = {GOOD: (" ✓", "green"), BAD: (" ✗", "bold red"), "": ("", "")}
_STYLES = {band.name: band.terminal for band in BANDS}
_PLACES = {"batch": "the core's batch", "mujoco": "MuJoCo", "ros": "MuJoCo, through the deployed ROS nodes"}
_WIDTH = 170  # columns, where the output is not a terminal


def print_tables(document: dict[str, Any], output: Console) -> None:
    """Print both tables, what their figures are, what is not met, and the conclusion."""
    console = wide(output, _WIDTH)
    poses, paths = pose_lines(document), path_lines(document)
    if poses:
        console.print(_table("Go to pose under disturbances", pose_heads(), poses))
        console.print(_key())
    if paths:
        console.print(_table("Paths followed at 0.2 m/s", PATH_HEADS, paths))
    for line in [*missing(document), *unmet(document)]:
        console.print(line, markup=False, style="yellow", soft_wrap=True)
    for line in [*notes(document), conclusion(document)]:
        console.print(line, markup=False, soft_wrap=True)


def conclusion(document: dict[str, Any]) -> str:
    """One sentence on what was required and met."""
    asked, met, open_ = document["asked"], document["met"], document["open"]
    return f"{met} of {asked} figures that are required are met" + (
        f"; {open_} could not be evaluated." if open_ else "."
    )


def notes(document: dict[str, Any]) -> list[str]:
    """What one has to know to read the tables."""
    lines = []
    kinds = {row["kind"] for row in document["rows"].values()}
    if "pose" in kinds:
        lines.append(
            f"{document['episodes']:,} trajectories of 50 s in each condition, in {_PLACES[document['through']]}, seed "
            f"{document['seed']}; means over trajectories, of true states. Rows of DRIFT: thesis Table 3.5."
        )
        lines.append(
            "Bound: the most that the straight way from rest allows with the strongest thrust and the row's own push. "
            "Feasible: the trajectories whose pose can be held at all with the thrusters left, by a "
            "linear programme over shares of open time."
        )
    if "path" in kinds:
        lines.append(
            f"Paths: up to {PATH_EPISODES} runs of {PATH_EPISODE_S:g} s from rest, mean ± standard deviation over the "
            f"whole run as in thesis Table 3.6; under way: without the first {RUN_UP_S:g} s."
        )
    if document["steps_per_s"]:
        lines.append(
            f"{document['control_steps']:,} control steps, {document['steps_per_s']:,.0f} a second while evaluating."
        )
    return lines


def _table(title: str, heads: Sequence[str], lines: Sequence[Line]) -> Table:
    table = Table(title=title, title_justify="left")
    for head in ("", ""):
        table.add_column(head)
    for head in heads:
        table.add_column(head, justify="right")
    for number, line in enumerate(lines):
        style = {"published": "dim", "bound": "italic"}.get(line.kind, "")
        last = number + 1 == len(lines) or lines[number + 1].row != line.row
        table.add_row(
            line.title,
            Text(line.controller, style),
            *(_text(cell, style) for cell in line.cells),
            end_section=last,
        )
    return table


def _text(cell: Cell, style: str) -> Text:
    text = Text(cell.text, style=f"{style} {_STYLES.get(cell.band, '')}".strip())
    mark, colour = _MARKS[cell.tone]
    return text.append(mark, colour)


def _key() -> Text:
    """What the colours mean."""
    text, low = Text("behind the same controller's ideal row by "), 0.0
    for band in BANDS:
        text.append(f" {low:.0f}–{band.most:.0f} % ", band.terminal)
        text.append(" ")
        low = band.most
    return text
