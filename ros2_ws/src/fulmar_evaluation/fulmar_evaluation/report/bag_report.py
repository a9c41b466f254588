"""Report of a bag that names no task: path, speed, actuator commands, delays and rates.

Runs of Fulmar have a task and a goal; `run_report` draws them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from fulmar_bags.bag_reading import TWIST
from fulmar_bags.contents import Bag
from fulmar_bags.decode import (
    Odometries,
    Vectors,
    joint_vectors,
    messages,
    odometries,
    stamp_of,
    twist_vectors,
)
from fulmar_bags.figures import describe
from fulmar_bags.gathered import Topic
from fulmar_core.robots.topics import SENSOR_WIRES
from fulmar_evaluation.report.frame_plot import NS, Strip, draw_strip, frame_plot, strip_of
from fulmar_evaluation.report.page import Part, Plot, cells, html_page, table
from fulmar_evaluation.report.space_plot import SIDES
from fulmar_evaluation.report.style import BODY_AXES, CONTROLLER_COLOURS, legend, quiet_grid
from fulmar_evaluation.report.supply_plot import draw_pressure
from fulmar_evaluation.report.writer import write_document

WIDTH = 6.2  # [inch]
COLOUR = CONTROLLER_COLOURS["policy"]
COMMANDS = {
    "sensor_msgs/msg/JointState": lambda topic: joint_vectors(topic, "effort"),
    "geometry_msgs/msg/TwistStamped": twist_vectors,
    TWIST: twist_vectors,
}
MOST_ACTUATORS = 16
LARGEST_TILT = np.deg2rad(30.0)  # of a body in the plane [rad]; a hull rolls in waves
LARGEST_RISE = 0.3  # of a body in the plane, of its way [-]
_PACE_IN_SPACE = "Size of the velocity, and of the turn rate about whatever axis it is."


@dataclass(frozen=True)
class Drawing:
    """One plot before it is drawn."""

    title: str
    caption: str
    height: float  # [inch]
    draw: Callable[[Axes], None]


def write_bag_report(
    bag: Bag, out: Path, odometry: str | None = None, *, note: str = "", force: bool = True
) -> Path:
    """Draw a bag.

    Args:
        bag: Any bag with odometry.
        out: A `.html` page that works offline, or a `.png` image. Its folder is made.
        odometry: Topic, where there are several.
        note: A sentence for the page.
        force: Replace whatever file is there; False: only a report of the same bag.

    Raises:
        BagError: The bag holds no odometry.
        ConfigError: As `write_document` says.
    """
    topic = bag.odometry(odometry)
    seen = odometries(topic)
    drawings, title = _drawings(bag, seen), f"{bag.path.name}: {topic.name}"
    strip = strip_of(tuple(bag.topics.values()), seen.stamp_ns / NS, seen.pose[:, :3])

    def page(mark: str) -> str:
        parts: list[Part] = [f"<p>{escape(note)}</p>"] if note else []
        parts += [frame_plot([("", strip)])] if strip else []
        parts += [Plot(each.title, each.caption, _sheet([each], WIDTH)) for each in drawings]
        return html_page(title, [*parts, *_rates(describe(bag)["topics"])], mark=mark)

    return write_document(
        out, [bag.path], page=page, sheet=lambda: _sheet(drawings, WIDTH + 1.0, title, strip), force=force
    )


def _drawings(bag: Bag, seen: Odometries) -> list[Drawing]:
    time_s = (seen.stamp_ns - seen.stamp_ns[0]) / 1e9 if len(seen) else np.zeros(0)
    space, stays = _leaves_the_plane(seen), _stays(seen)
    speed = np.linalg.norm(seen.twist[:, : 3 if space else 2], axis=1)
    turning = np.linalg.norm(seen.twist[:, 3:], axis=1) if space else seen.twist[:, 5]

    low, high = (pick(seen.pose[:, :3], axis=0) if space else np.zeros(3) for pick in (np.min, np.max))
    middle, reach = 0.5 * (low + high), 0.6 * max(*(high - low)[1:], 0.4 * (high - low)[0], 0.1)

    def path(axes: Axes, up: int = 1) -> None:
        axes.plot(seen.pose[:, 0], seen.pose[:, up], color=COLOUR)
        if len(seen):
            axes.plot(*seen.pose[0, [0, up]], "o", color=COLOUR, fillstyle="none", label="begin")
            axes.plot(*seen.pose[-1, [0, up]], "o", color=COLOUR, label="end")
        axes.set_aspect("equal", adjustable="datalim")
        if space:  # the same span, and so one scale for both views
            axes.set_ylim(middle[up] - reach, middle[up] + reach)
        axes.set_xlabel("x [m]")
        axes.set_ylabel(f"{'xyz'[up]} [m]")
        legend(axes, loc="best")

    def side(axes: Axes) -> None:
        path(axes, up=2)

    def pace(axes: Axes) -> None:
        axes.plot(time_s, speed, color=COLOUR, label="speed [m/s]")
        axes.plot(time_s, turning, color=CONTROLLER_COLOURS["lqr"], label="turn rate [rad/s]")
        axes.set_xlabel("time [s]")
        legend(axes, loc="best", ncols=2)

    def delay(axes: Axes) -> None:
        late = (seen.log_ns - seen.stamp_ns).astype(float)
        axes.plot(time_s, (late - late.min()) / 1e6 if len(late) else late, ".", ms=2.0, color=COLOUR)
        axes.set_xlabel("time [s]")
        axes.set_ylabel("delay [ms]")

    def turns(axes: Axes) -> None:
        for axis, colour, rate in zip("xyz", BODY_AXES, np.rad2deg(seen.twist[:, 3:]).T, strict=True):
            axes.plot(time_s, rate, color=colour, lw=1.1, label=f"about {axis}")
        axes.set_xlabel("time [s]")
        axes.set_ylabel("turn rate [°/s]")
        legend(axes, loc="best", ncols=3)

    found = [
        Drawing(
            f"The path, seen {SIDES[0].title if space else SIDES[0].name}",
            "As the odometry reports it.",
            4.0,
            path,
        ),
        *([Drawing(f"The path, seen {SIDES[1].title}", "At the same scale.", 4.0, side)] if space else []),
        Drawing(
            "How fast", _PACE_IN_SPACE if space else "Speed and turn rate in the body's frame.", 2.2, pace
        ),
    ]
    if stays:
        found = [
            Drawing("How it turned", "About the axes of the body; its place stays the same.", 2.2, turns)
        ]
    for topic in bag.topics.values():
        if topic.type in COMMANDS and len(topic):
            measured = topic.name.endswith(f"/{SENSOR_WIRES['surfaces'].name}")
            vectors = joint_vectors(topic, "position") if measured else COMMANDS[topic.type](topic)
            if len(vectors) and 0 < len(vectors.names) <= MOST_ACTUATORS:
                found.append(_actuators(topic.name, vectors, _seconds(vectors, seen, topic.type == TWIST)))
        if topic.type == SENSOR_WIRES["supply"].type and len(topic):
            found.append(_pressure(topic, seen))
    if not (bag.info or {}).get("lockstep"):  # where stamps and clocks have nothing to do with each other
        late = "Recorded minus stamped, beyond the quickest message."
        found.append(Drawing("How late the odometry came", late, 2.0, delay))
    return found


def _pressure(topic: Topic, seen: Odometries) -> Drawing:
    """Any topic of pressures, such as that of the gas supply."""
    read = [message for _, message in messages(topic)]
    stamp_ns = np.array([stamp_of(message) for message in read], dtype=np.int64)
    pascal = np.array([message.fluid_pressure for message in read], dtype=float)
    begin_ns = seen.stamp_ns[0] if len(seen) else stamp_ns.min(initial=0)

    def draw(axes: Axes) -> None:
        draw_pressure(axes, (stamp_ns - begin_ns) / 1e9, pascal, COLOUR)

    return Drawing(f"Pressure: {topic.name}", "As the gauge reports it.", 2.0, draw)


def _leaves_the_plane(seen: Odometries) -> bool:
    """Whether a body tilts as none does that stands, floats or rolls upright, or moves up and down by as much."""
    if not len(seen):
        return False
    upright = 1.0 - 2.0 * np.sum(seen.pose[:, 3:5] ** 2, axis=1)  # cosine of the tilt
    wide = np.ptp(seen.pose[:, :3], axis=0)
    return bool(np.min(upright) < np.cos(LARGEST_TILT) or wide[2] > LARGEST_RISE * max(1.0, *wide[:2]))


def _stays(seen: Odometries) -> bool:
    """Whether a body turns at one place, as satellites do, of which no place is measured."""
    return bool(len(seen)) and not np.ptp(seen.pose[:, :3], axis=0).any() and bool(seen.twist[:, 3:].any())


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


def _sheet(drawings: Sequence[Drawing], width: float, title: str = "", strip: Strip | None = None) -> Figure:
    """Drawings below one another, what cameras saw last; with a title over the sheet, each has its own."""
    heights = [drawing.height for drawing in drawings]
    rows = [sum(heights), *([strip.height] if strip else [])]
    figure = Figure(figsize=(width, sum(rows)), layout="constrained")
    upper: Figure | SubFigure = figure
    if strip:
        upper, lower = figure.subfigures(2, 1, height_ratios=rows)
        draw_strip(lower, strip)
    axes = upper.subplots(len(drawings), 1, height_ratios=heights, squeeze=False)[:, 0]
    for one, drawing in zip(axes, drawings, strict=True):
        drawing.draw(one)
        one.set_title(drawing.title if title else "")
        quiet_grid(one)
    if title:
        figure.suptitle(title, fontweight="bold")
    return figure


def _rates(topics: Sequence[dict[str, Any]]) -> list[str]:
    """Counts, rates and gaps of the topics as a table."""

    def number(value: float | None, digits: int) -> str:
        return "–" if value is None else f"{value:.{digits}f}"

    heads = cells(("topic", "messages", "rate [Hz]", "longest gap [s]"), "th")
    rows = [
        (topic["name"], str(topic["count"]), number(topic["rate_hz"], 2), number(topic["longest_gap_s"], 3))
        for topic in topics
    ]
    return ["<h2>Rates</h2>", table([heads], (f"<tr>{cells(row)}</tr>" for row in rows))]
