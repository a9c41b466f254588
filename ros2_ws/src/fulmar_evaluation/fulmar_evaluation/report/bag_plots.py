"""Pictures of a bag that names no task: where it went, how fast, what its actuators did, how late its messages came.

Runs of Fulmar have a task and a goal, and `fulmar_evaluation.report` draws them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fulmar_bags.contents import Bag
from fulmar_bags.decode import TWIST, Odometries, Vectors, joint_vectors, odometries, twist_vectors
from fulmar_bags.figures import describe
from fulmar_core.errors import ConfigError
from fulmar_evaluation.report.page import STYLE
from fulmar_evaluation.report.sources import check_overwrite, source_mark
from fulmar_evaluation.report.style import CONTROLLER_COLOURS, as_png, as_svg, house_style, legend, quiet_grid

WIDTH = 6.2  # [inch]
COLOUR = CONTROLLER_COLOURS["policy"]
COMMANDS = {
    "sensor_msgs/msg/JointState": lambda topic: joint_vectors(topic, "effort"),
    "geometry_msgs/msg/TwistStamped": twist_vectors,
    TWIST: twist_vectors,
}
MOST_ACTUATORS = 16


@dataclass(frozen=True)
class Drawing:
    """One picture with its words."""

    title: str
    caption: str
    height: float  # [inch]
    draw: Callable[[Axes], None]


def write_pictures(
    bag: Bag, out: Path, odometry: str | None = None, *, note: str = "", force: bool = True
) -> Path:
    """Draw a bag.

    Args:
        bag: Any bag with odometry.
        out: A `.html` page that works offline, or a `.png` picture. Its folder is made.
        odometry: Topic, where there are several.
        note: A sentence for the page.
        force: Replace whatever file is there; False: only a report of the same bag.

    Raises:
        BagError: The bag holds no odometry.
        ConfigError: Another kind of file was asked for, or a file of something else is there.
        OSError: It cannot be written.
    """
    if out.suffix not in (".html", ".png"):
        raise ConfigError(f"{out}: a plot is a .html page or a .png picture. Give such a name.")
    mark = source_mark([bag.path])
    if not force:
        check_overwrite(out, mark)
    topic = bag.odometry(odometry)
    drawings = _drawings(bag, odometries(topic))
    title = f"{bag.path.name}: {topic.name}"
    with house_style():
        data = (
            as_png(_sheet(drawings, title), mark)
            if out.suffix == ".png"
            else _page(drawings, title, mark, [note] if note else [], describe(bag)["topics"]).encode()
        )
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_bytes(data)
    return out


def _drawings(bag: Bag, seen: Odometries) -> list[Drawing]:
    time_s = (seen.stamp_ns - seen.stamp_ns[0]) / 1e9 if len(seen) else np.zeros(0)
    speed = np.hypot(seen.twist[:, 0], seen.twist[:, 1])

    def path(axes: Axes) -> None:
        axes.plot(seen.pose[:, 0], seen.pose[:, 1], color=COLOUR)
        if len(seen):
            axes.plot(*seen.pose[0, :2], "o", color=COLOUR, fillstyle="none", label="begin")
            axes.plot(*seen.pose[-1, :2], "o", color=COLOUR, label="end")
        axes.set_aspect("equal", adjustable="datalim")
        axes.set_xlabel("x [m]")
        axes.set_ylabel("y [m]")
        legend(axes, loc="best")

    def pace(axes: Axes) -> None:
        axes.plot(time_s, speed, color=COLOUR, label="speed [m/s]")
        axes.plot(time_s, seen.twist[:, 5], color=CONTROLLER_COLOURS["lqr"], label="turn rate [rad/s]")
        axes.set_xlabel("time [s]")
        legend(axes, loc="best", ncols=2)

    def delay(axes: Axes) -> None:
        late = (seen.log_ns - seen.stamp_ns).astype(float)
        axes.plot(time_s, (late - late.min()) / 1e6 if len(late) else late, ".", ms=2.0, color=COLOUR)
        axes.set_xlabel("time [s]")
        axes.set_ylabel("delay [ms]")

    found = [
        Drawing("The path, seen from above", "As the odometry tells it.", 4.0, path),
        Drawing("How fast", "Speed and turn rate in the body's frame.", 2.2, pace),
    ]
    for topic in bag.topics.values():
        if topic.type in COMMANDS and len(topic):
            vectors = COMMANDS[topic.type](topic)
            if len(vectors) and 0 < len(vectors.names) <= MOST_ACTUATORS:
                found.append(_actuators(topic.name, vectors, _seconds(vectors, seen, topic.type == TWIST)))
    found.append(
        Drawing(
            "How late the odometry came", "Recorded minus stamped, beyond the quickest message.", 2.0, delay
        )
    )
    return found


def _seconds(vectors: Vectors, seen: Odometries, unstamped: bool) -> np.ndarray:
    """Times of vectors since the first odometry; of those without stamps, by when both were recorded [s]."""
    if not len(seen):
        return (vectors.stamp_ns - vectors.stamp_ns[0]) / 1e9
    if not unstamped:
        return (vectors.stamp_ns - seen.stamp_ns[0]) / 1e9
    logs, stamps = (times - times[0] for times in (seen.log_ns, seen.stamp_ns))
    return np.interp(vectors.log_ns - seen.log_ns[0], logs, stamps) / 1e9


def _actuators(name: str, vectors: Vectors, time_s: np.ndarray) -> Drawing:
    largest = float(np.abs(vectors.values).max()) or 1.0

    def draw(axes: Axes) -> None:
        for row, label in enumerate(vectors.names):
            level = len(vectors.names) - 1 - row
            axes.step(
                time_s, level + 0.4 * vectors.values[:, row] / largest, where="post", color=COLOUR, lw=0.9
            )
            axes.text(
                -0.01, level, label, transform=axes.get_yaxis_transform(), ha="right", va="center", fontsize=7
            )
        axes.set_yticks([])
        axes.set_xlabel("time [s]")

    caption = f"The full height of a row is {largest:.3g}."
    return Drawing(f"What the actuators did: {name}", caption, 0.8 + 0.28 * len(vectors.names), draw)


def _sheet(drawings: Sequence[Drawing], title: str) -> Figure:
    heights = [drawing.height for drawing in drawings]
    figure = Figure(figsize=(WIDTH + 1.0, sum(heights)), layout="constrained")
    for axes, drawing in zip(figure.subplots(len(drawings), 1, height_ratios=heights), drawings, strict=True):
        drawing.draw(axes)
        axes.set_title(drawing.title)
        quiet_grid(axes)
    figure.suptitle(title, fontweight="bold")
    return figure


def _rates(topics: Sequence[dict[str, Any]]) -> str:
    """Counts, rates and gaps of the topics as a table."""
    rows = "".join(
        f"<tr><td>{escape(topic['name'])}</td><td>{topic['count']}</td>"
        f"<td>{'–' if topic['rate_hz'] is None else format(topic['rate_hz'], '.2f')}</td>"
        f"<td>{'–' if topic['longest_gap_s'] is None else format(topic['longest_gap_s'], '.3f')}</td></tr>"
        for topic in topics
    )
    heads = "".join(f"<th>{head}</th>" for head in ("topic", "messages", "rate [Hz]", "longest gap [s]"))
    return f'<h2>Rates</h2><div class="scroll"><table><tr>{heads}</tr>{rows}</table></div>'


def _page(
    drawings: Sequence[Drawing],
    title: str,
    mark: str,
    notes: Sequence[str],
    topics: Sequence[dict[str, Any]],
) -> str:
    parts = [f"<p>{escape(note)}</p>" for note in notes]
    for drawing in drawings:
        figure = Figure(figsize=(WIDTH, drawing.height), layout="constrained")
        axes = figure.subplots()
        drawing.draw(axes)
        quiet_grid(axes)
        parts.append(
            f"<h2>{escape(drawing.title)}</h2><figure>{as_svg(figure)}</figure>"
            f'<p class="faint">{escape(drawing.caption)}</p>'
        )
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<meta name="fulmar-source" content="{escape(mark)}">'
        f"<title>{escape(title)}</title><style>{STYLE}</style></head><body>\n<h1>{escape(title)}</h1>\n"
        + "\n".join([*parts, _rates(topics)])
        + "\n</body></html>\n"
    )
