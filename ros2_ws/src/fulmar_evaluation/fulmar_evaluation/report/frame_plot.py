"""What cameras saw along the way: colours, depth and segmentation at some times, with the place of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from fulmar_bags.frame_messages import Frame
from fulmar_bags.frame_topics import Camera, cameras
from fulmar_bags.gathered import Topic
from fulmar_core.config.errors import BagError
from fulmar_evaluation.report.page import Plot
from fulmar_evaluation.report.style import FAINT

NS = 1_000_000_000
COLUMNS = 6  # times
MOST_ROWS = 6  # kinds and cameras of one bag
WIDEST = 240  # of an image on a page [px]
WIDTH = 6.2  # of a strip [inch]
TITLE_HEIGHT = 0.42  # of the times and places above it [inch]
NOTHING = (0.55, 0.58, 0.62, 0.35)  # where nothing is
FARTHEST = 97.0  # what is farther than this share of what is shown looks the same [%]


@dataclass(frozen=True)
class Strip:
    """The frames of one bag that are shown.

    Attributes:
        seen: Cameras, colours first; one row each.
        time_ns: Of the columns, shape (k,) [ns].
        begin_ns: Where the time of the report begins [ns].
        places: Positions at these times, shape (k, 3), NaN where none is known [m].
        notes: What is not shown, a line each.
    """

    seen: tuple[Camera, ...]
    time_ns: np.ndarray
    begin_ns: float
    places: np.ndarray
    notes: tuple[str, ...]

    @property
    def height(self) -> float:
        """Room for it at full width [inch]."""
        shares = [each.first.size[1] / each.first.size[0] for each in self.seen]
        return TITLE_HEIGHT + sum(WIDTH / COLUMNS * share + 0.06 for share in shares)


def strip_of(topics: Sequence[Topic], stamp_s: np.ndarray, position: np.ndarray) -> Strip | None:
    """What is to be shown of the cameras of a bag; None where it has none.

    Args:
        topics: Of the bag.
        stamp_s: Times of a motion, shape (n,) [s].
        position: Its places, shape (n, 3) [m].
    """
    notes: list[str] = []
    found = cameras(topics, notes)
    seen, more = found[:MOST_ROWS], found[MOST_ROWS:]
    if not seen:
        return None
    notes += [f"{each.topic.name} is not shown: {MOST_ROWS} rows are enough." for each in more]
    taken = seen[0].taken_ns
    times = np.linspace(taken[0], taken[-1], COLUMNS) if len(taken) > 1 else taken[:1].astype(float)
    begin = stamp_s[0] * NS if len(stamp_s) else float(taken[0])
    within = (
        (times >= begin - NS) & (times <= stamp_s[-1] * NS + NS)
        if len(stamp_s)
        else np.zeros(len(times), bool)
    )
    places = np.full((len(times), 3), np.nan)
    if within.any() and np.ptp(position, axis=0).any():
        for axis in range(3):
            places[within, axis] = np.interp(times[within] / NS, stamp_s, position[:, axis])
    return Strip(tuple(seen), times, begin if within.any() else float(taken[0]), places, tuple(notes))


def draw_strip(figure: Figure | SubFigure, strip: Strip) -> None:
    """Draw the frames: a row for each camera and kind, a column for each time."""
    ratios = [each.first.size[1] / each.first.size[0] for each in strip.seen]
    grid = figure.subplots(len(strip.seen), len(strip.time_ns), squeeze=False, height_ratios=ratios)
    for row, each in zip(grid, strip.seen, strict=True):
        frames = [_frame_at(each, time) for time in strip.time_ns]
        look = _look(each.kind, frames)
        for axes, frame in zip(row, frames, strict=True):
            axes.set_xticks([])
            axes.set_yticks([])
            axes.spines[:].set_visible(False)
            if frame is None:
                axes.text(0.5, 0.5, "damaged", ha="center", va="center", fontsize=7, transform=axes.transAxes)
            else:
                _show(axes, frame, look)
        row[0].set_ylabel(each.kind, fontsize=7.5, color=FAINT)
    for axes, time, place in zip(grid[0], strip.time_ns, strip.places, strict=True):
        where = "" if np.isnan(place).any() else "\n" + ", ".join(f"{value:.2f}" for value in place) + " m"
        axes.set_title(f"{(time - strip.begin_ns) / NS:.1f} s{where}", fontsize=7)


def frame_plot(strips: Sequence[tuple[str, Strip]]) -> Plot:
    """A section of a report.

    Args:
        strips: One for each bag, with its name where there are several.
    """
    figure = Figure(
        figsize=(WIDTH, sum(strip.height + 0.25 * bool(name) for name, strip in strips)), layout="constrained"
    )
    heights = [strip.height for _, strip in strips]
    parts = figure.subfigures(len(strips), 1, height_ratios=heights, squeeze=False)[:, 0]
    for part, (name, strip) in zip(parts, strips, strict=True):
        draw_strip(part, strip)
        if name:
            part.suptitle(name, fontsize=8.5)
    caption = "Time since the begin and position above each."
    kinds = {each.kind for _, strip in strips for each in strip.seen}
    if "depth" in kinds:
        caption += " Depth is dark where it is near and light where it is far; grey: nothing is there."
    if "segmentation" in kinds:
        caption += " Each id of the segmentation has its colour; grey: none."
    notes = [f"Not shown: {note}" for _, strip in strips for note in strip.notes]
    return Plot("What the camera saw", " ".join([caption, *notes]), figure)


def _frame_at(seen: Camera, time_ns: float) -> Frame | None:
    try:
        return seen.frame(seen.nearest(time_ns))
    except BagError:
        return None


def _look(kind: str, frames: Sequence[Frame | None]) -> dict[str, object]:
    """How the pixels of one row become colours: alike in all of its frames."""
    there = [frame.pixels for frame in frames if frame is not None]
    if kind == "colour" or not there:
        return {}
    if kind == "segmentation":
        ids = np.unique(np.concatenate([np.unique(pixels) for pixels in there]))
        return {"ids": ids[ids > 0]}
    near = np.concatenate([pixels[np.isfinite(pixels)] for pixels in there])
    if not len(near):
        return {"vmin": 0.0, "vmax": 1.0, "cmap": _map("viridis")}
    return {"vmin": near.min(), "vmax": np.percentile(near, FARTHEST), "cmap": _map("viridis")}


def _map(name: str) -> object:
    return mpl.colormaps[name].with_extremes(bad=NOTHING)


def _show(axes: Axes, frame: Frame, look: dict[str, object]) -> None:
    step = max(1, -(-frame.size[0] // WIDEST))
    pixels = frame.pixels[::step, ::step]
    if frame.kind == "segmentation":
        known = np.asarray(look["ids"])
        colours = np.array([NOTHING, *(mpl.colormaps["tab20"](i % 20) for i in range(len(known)))])
        pixels = colours[np.where(pixels > 0, np.searchsorted(known, pixels) + 1, 0)]
        look = {}
    elif frame.kind == "depth":
        pixels = np.ma.masked_invalid(pixels)
    axes.imshow(pixels, interpolation="none", **look)
