"""Cells of tables, requirement checks and names for people, shared by terminals and pages."""

from __future__ import annotations

from dataclasses import dataclass

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


def display_name(name: str) -> str:
    """Name of a robot or task in tables and reports."""
    return DISPLAY_NAMES.get(name, name.replace("_", " "))


@dataclass(frozen=True)
class Cell:
    """What is written, and how it compares with what is required."""

    text: str
    tone: str = ""  # GOOD, BAD, or nothing to say


@dataclass(frozen=True)
class Check:
    """One requirement and what was measured."""

    name: str
    measured: float | None  # None: not measured
    limit: float
    met: bool | None  # None: not measured
