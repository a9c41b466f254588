"""Colours by which the page tells robots apart."""

from __future__ import annotations

# Even steps of hue at one lightness, so that none looks more important; red is the e-stop's alone.
COLORS = (
    "#42a5f5", "#26c6da", "#66bb6a", "#ffca28", "#ab47bc", "#9ccc65", "#ffa726", "#ec407a", "#7e57c2", "#8d6e63",
)  # fmt: skip


def color_of(index: int) -> str:
    """The colour of a robot, by its index."""
    return COLORS[index % len(COLORS)]
