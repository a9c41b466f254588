"""Cells of tables, requirement checks and names for people, shared by terminals and pages."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from html import escape
from typing import Any

from rich.console import Console

from fulmar_core.config.provenance import fulmar_version, git_revision

DISPLAY_NAMES = {
    "floating_platform": "floating platform",
    "kingfisher": "Kingfisher",
    "turtlebot2": "Turtlebot2",
    "go_to_position": "Go to position",
    "go_to_pose": "Go to pose",
    "track_velocities": "Track velocities",
    "go_through_positions": "Go through positions",
    "go_to_position_with_obstacles": "Go to position with obstacles",
    "int_ball2": "Int-Ball2",
    "go_to_position_3d": "Go to position 3-D",
    "go_to_pose_3d": "Go to pose 3-D",
    "track_velocities_3d": "Track velocities 3-D",
    "go_through_positions_3d": "Go through positions 3-D",
    "go_through_poses_3d": "Go through poses 3-D",
}
GOOD, BAD = "good", "bad"
MARKS = {GOOD: " ✓", BAD: " ✗", "": ""}  # behind a cell of that tone
NOTHING = "–"
FORMAT = 1  # of documents


def display_name(name: str) -> str:
    """Name of a robot or task in tables and reports."""
    return DISPLAY_NAMES.get(name, name.replace("_", " "))


@dataclass(frozen=True)
class Cell:
    """What is written, and how it compares with what is required."""

    text: str
    tone: str = ""  # GOOD, BAD, or nothing to say


def number(value: float | None, digits: int, nothing: str = NOTHING) -> str:
    """A number, or a dash."""
    return nothing if value is None else f"{value:.{digits}f}"


def tone_of(met: bool | None) -> str:
    """Tone of a requirement; None: not measured."""
    return "" if met is None else GOOD if met else BAD


def as_html(text: str, tone: str, more: str = "") -> str:
    """Cell of a page, of further classes."""
    return f'<td class="{f"{tone} {more}".strip()}">{escape(text + MARKS[tone])}</td>'


def wide(output: Console, width: int) -> Console:
    """Where tables go: a console of so many columns where the output is not a terminal."""
    return output if output.is_terminal else Console(highlight=False, emoji=False, width=width)


def heading_of(name: str, command: str) -> dict[str, Any]:
    """How the document of a benchmark begins."""
    return {
        "benchmark": name,
        "format": FORMAT,
        "fulmar_version": fulmar_version(),
        "git_revision": git_revision(),
        "command": command,
    }


def tally(met: Iterable[bool | None]) -> dict[str, int]:
    """How many requirements there are, how many are met, and how many could not be measured."""
    known = list(met)
    return {
        "asked": len(known),
        "met": sum(one is True for one in known),
        "open": sum(one is None for one in known),
    }


@dataclass(frozen=True)
class Check:
    """One requirement and what was measured."""

    name: str
    measured: float | None  # None: not measured
    limit: float
    met: bool | None  # None: not measured
