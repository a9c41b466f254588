"""Colours, type and axes that every plot shares.

Plots in a page are drawn once and serve light and dark screens: what is drawn in INK, FAINT or PAPER
becomes a colour of the page's style sheet.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO, StringIO
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from PIL import Image
from PIL.PngImagePlugin import PngInfo

COLOURS = 255  # of an image: lines and letters have few, and it becomes a third as large
INK, FAINT, PAPER = "#1f2430", "#8a919e", "#fefefd"
ALARM = "#d6336c"
BODY_AXES = ("#c25b52", "#4f9a57", "#7d5ba6")  # x, y, z of a body in space; no blue: policies are
DASHED = (0, (4, 3))
STROKES = ("-", DASHED, (0, (1, 1.5)), (0, (5, 2, 1, 2)))  # of runs whose colours mean something else
READABLE = {"facecolor": PAPER, "edgecolor": "none", "alpha": 0.75, "pad": 1.0}  # of words over a curve
VARIABLES = {INK: "var(--ink)", FAINT: "var(--faint)", PAPER: "var(--paper)"}

# A controller keeps its colour from report to report; each is readable on white and on near-black.
CONTROLLER_COLOURS = {
    "policy": "#3b7ddd",
    "lqr": "#d9780f",
    "pd": "#7c8a14",
    "mpc": "#a23b9e",
    "lqr_drift": "#8a6d3b",
    "classical": "#1a9e84",
    "lqi": "#6a55c2",
    "excite": "#777777",
}
PARTS = (
    *BODY_AXES,
    CONTROLLER_COLOURS["policy"],
    CONTROLLER_COLOURS["lqr"],
)  # of surfaces, throttles, wheels
OTHER_COLOURS = ("#8d62d9", "#3f9e4d", "#b8860b", "#5f7a8c")

_RC = {
    "font.family": "sans-serif",
    **dict.fromkeys(("font.size", "axes.titlesize", "axes.labelsize"), 9.5),
    **dict.fromkeys(("text.color", "axes.labelcolor", "xtick.labelcolor", "ytick.labelcolor"), INK),
    **dict.fromkeys(("axes.edgecolor", "xtick.color", "ytick.color", "grid.color"), FAINT),
    **dict.fromkeys(("axes.spines.top", "axes.spines.right", "legend.frameon"), False),
    "axes.facecolor": "none",
    "axes.linewidth": 0.8,
    "grid.alpha": 0.22,
    "grid.linewidth": 0.6,
    "legend.borderaxespad": 0.2,
    "lines.linewidth": 1.6,
    "lines.solid_capstyle": "round",
    "svg.fonttype": "none",
    "svg.hashsalt": "fulmar",
    "path.simplify_threshold": 0.3,
}


@contextmanager
def house_style(**more: object) -> Iterator[None]:
    """Draw in the style of the house; `more` are parameters of matplotlib, with _ for their dots."""
    with mpl.rc_context(_RC | {key.replace("_", ".", 1): value for key, value in more.items()}):
        yield


def colours(controllers: Sequence[str]) -> list[str]:
    """One colour for each run; two runs of one controller differ."""
    spare = iter(OTHER_COLOURS * (1 + len(controllers) // len(OTHER_COLOURS)))
    taken: list[str] = []
    for name in controllers:
        colour = CONTROLLER_COLOURS.get(name, "")
        taken.append(colour if colour and colour not in taken else next(spare))
    return taken


def quiet_grid(axes: Axes) -> None:
    """A grid that one can ignore."""
    axes.grid(True, which="major")
    axes.set_axisbelow(True)
    axes.tick_params(length=3.0, which="major")
    axes.tick_params(length=0.0, which="minor")


def legend(axes: Axes, **how: object) -> None:
    """A legend, where something has a name."""
    if axes.get_legend_handles_labels()[0]:
        axes.legend(**how)


def legend_above(figure: Figure | SubFigure, axes: Axes, most: int = 6) -> None:
    """What the lines of some axes mean, above the whole figure, where it covers none of them."""
    handles, labels = axes.get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="outside upper left", ncols=min(len(labels), most), fontsize=8.5)


def legend_over(axes: Axes, most: int = 6) -> None:
    """The same to the right above one of several axes."""
    handles, labels = axes.get_legend_handles_labels()
    if handles:
        look: dict[str, Any] = {
            "loc": "lower right",
            "bbox_to_anchor": (1.0, 1.0),
            "fontsize": 8.5,
            "handlelength": 1.2,
        }
        axes.legend(handles, labels, ncols=min(len(labels), most), columnspacing=1.2, **look)


def as_svg(figure: Figure) -> str:
    """A figure as an element of a page, in the page's own colours and type."""
    stream = StringIO()
    figure.savefig(stream, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
    text = stream.getvalue()
    text = text[text.index("<svg") :]
    for colour, variable in VARIABLES.items():
        text = text.replace(colour, variable)
    return text


def as_png(figure: Figure, mark: str = "", *, dpi: int = 130) -> bytes:
    """A figure as an image on white, in few colours, with the mark of `report.writer` where one is given."""
    drawn, small, metadata = BytesIO(), BytesIO(), PngInfo()
    figure.savefig(drawn, format="png", dpi=dpi, facecolor="white")
    if mark:
        metadata.add_text("Source", mark)
    image = Image.open(drawn).convert("RGB")
    # Of the ways to choose colours, the one that keeps those of thin lines.
    image = image.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    image.save(small, format="png", optimize=True, pnginfo=metadata)
    return small.getvalue()
