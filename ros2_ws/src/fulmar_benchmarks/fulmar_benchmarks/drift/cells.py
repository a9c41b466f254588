"""The document as rows of cells: one definition for terminals and pages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from fulmar_benchmarks.drift.conditions import PATH_EPISODE_S, PATH_EPISODES, RUN_UP_S
from fulmar_benchmarks.drift.targets import BANDS, DIGITS, FIGURES
from fulmar_benchmarks.tables import NOTHING, Entry, Row, Shown, Table, tone_of

_PLACES = {"batch": "the core's batch", "mujoco": "MuJoCo", "ros": "MuJoCo, through the deployed ROS nodes"}
STYLE = (
    "".join(f".{band.name} {{ background: {band.paper} }} " for band in BANDS)
    + """
th, td { padding: .25rem .4rem; font-size: .87rem } th { white-space: normal; vertical-align: bottom }
td:first-child { white-space: nowrap } td:nth-child(2) { text-align: left; white-space: nowrap }
tr.published td { color: var(--faint) } tr.bound td { font-style: italic }
tr.last td { border-bottom: 2px solid var(--rule) }
"""
)

DISPLAY_NAMES = {"policy": "policy", "lqr": "LQR", "lqr_drift": "LQR of DRIFT", "mpc": "MPC"}
UNITS = {**{name: "%" for name in FIGURES if name[1] == "T"}, "ALV": "m/s", "AAV": "rad/s", "AAS": ""}


@dataclass(frozen=True)
class Line:
    """One controller in one row."""

    row: str
    title: str  # of the row, on its first line only
    controller: str
    cells: tuple[Entry, ...]
    # ours; feasible: of the episodes whose pose can be held; published; bound: what physics allows
    kind: str = "ours"


def display_name(controller: str) -> str:
    """Name of a controller in tables and reports."""
    return DISPLAY_NAMES.get(controller, controller.replace("_", " "))


def pose_lines(document: Mapping[str, Any]) -> list[Line]:
    """Of each condition: our controllers, each with DRIFT's own below it."""
    tones = _tones(document)
    lines: list[Line] = []
    for name, row in document["rows"].items():
        if row["kind"] != "pose":
            continue
        title, share = row["title"], row["feasible_share"]
        for controller, entry in row["controllers"].items():
            ours = tuple(
                _ours(entry, figure, tones.get((name, controller, figure), "")) for figure in FIGURES
            )
            lines.append(Line(name, title, display_name(controller), ours))
            title = ""
            if entry.get("where_feasible") and share < 1.0:
                where = entry["where_feasible"]["figures"]
                able = tuple(Entry(_written(figure, where[figure]["mean"])) for figure in FIGURES)
                lines.append(Line(name, "", f"feasible {100.0 * share:.0f} %", able, "feasible"))
            beside = entry["published_controller"]
            theirs = tuple(_theirs(entry, figure) for figure in FIGURES)
            lines.append(Line(name, "", f"DRIFT's {beside}", theirs, "published"))
        most = tuple(
            Entry(f"{row['bound'][figure]['mean']:.1f}" if figure in row["bound"] else "")
            for figure in FIGURES
        )
        lines.append(Line(name, "", "bound", most, "bound"))
    return lines


def path_lines(document: Mapping[str, Any]) -> list[Line]:
    """Of each path: our controllers, and DRIFT's policy."""
    tones = _tones(document)
    lines: list[Line] = []
    for name, row in document["rows"].items():
        if row["kind"] != "path":
            continue
        title = row["title"]
        for controller, entry in row["controllers"].items():
            tone = tones.get((name, controller, "velocity_error"), "")
            cells = (
                Entry(_spread(entry, "velocity_error", 3), tone),
                Entry(_spread(entry, "velocity_error_under_way", 3)),
                Entry(_spread(entry, "path_error", 3)),
                Entry(_mean(entry, "path_error_most", 3)),
                Entry(_mean(entry, "AAS", 2)),
            )
            lines.append(Line(name, title, display_name(controller), cells))
            title = ""
        published = row["published"]
        text = f"{published['velocity_error']:.2f} ± {published['velocity_error_std']:.2f}"
        empty = (Entry(""),) * 4
        lines.append(Line(name, "", "DRIFT's RL", (Entry(text), *empty), "published"))
    return lines


PATH_HEADS = ("velocity error [m/s]", "under way [m/s]", "off the path [m]", "at most [m]", "AAS")


def pose_heads() -> tuple[str, ...]:
    """Titles of the columns of `pose_lines`."""
    return tuple(f"{name} [{UNITS[name]}]" if UNITS[name] else name for name in FIGURES)


def unmet(document: Mapping[str, Any]) -> list[str]:
    """Requirements that were not met, in words."""
    sentences = []
    for check in document["requirements"]:
        if check["met"] is not False:
            continue
        sign = "≥" if check["better"] == "more" else "≤"
        digits = 1 if check["limit"] >= 1.0 else 3
        found = f"{check['measured']:.{digits + (digits > 1)}f}"
        title = document["rows"][check["row"]]["title"]
        figure = check["figure"].replace("_", " ")
        sentences.append(
            f"{title}, {display_name(check['controller'])}: {figure} {found}, "
            f"required {sign} {check['limit']:.{digits}f}"
        )
    return sentences


def missing(document: Mapping[str, Any]) -> list[str]:
    """Who did not drive, and why; each reason once."""
    found = {
        f"{display_name(controller)}: {entry['status']}: {entry['reason']}": None
        for row in document["rows"].values()
        for controller, entry in row["controllers"].items()
        if entry["status"] != "judged"
    }
    return list(found)


def _tones(document: Mapping[str, Any]) -> dict[tuple[str, str, str], str]:
    return {
        (check["row"], check["controller"], check["figure"]): tone_of(check["met"])
        for check in document["requirements"]
    }


def _ours(entry: dict[str, Any], figure: str, tone: str) -> Entry:
    if not entry["figures"]:
        return Entry(NOTHING)
    drop = entry.get("drops", {}).get(figure)
    return Entry(_written(figure, entry["figures"][figure]["mean"]), tone, drop["band"] if drop else "")


def _theirs(entry: dict[str, Any], figure: str) -> Entry:
    drop = entry["published_drops"][figure]
    return Entry(_written(figure, entry["published"][figure]), "", drop["band"] if drop else "")


def _written(figure: str, value: float) -> str:
    return f"{value:.{DIGITS[figure]}f}"


def _spread(entry: dict[str, Any], figure: str, digits: int) -> str:
    if not entry["figures"]:
        return NOTHING
    mean, std = entry["figures"][figure]["mean"], entry["figures"][f"{figure}_std"]["mean"]
    return f"{mean:.{digits}f} ± {std:.{digits}f}"


def _mean(entry: dict[str, Any], figure: str, digits: int) -> str:
    return f"{entry['figures'][figure]['mean']:.{digits}f}" if entry["figures"] else NOTHING


def shown(document: Mapping[str, Any]) -> list[Shown]:
    """Both tables, what their figures are, what is not met, and the conclusion."""
    poses, paths = pose_lines(document), path_lines(document)
    found: list[Shown] = []
    if poses:
        low, parts = 0.0, []
        for band in BANDS:
            parts.append(f"{low:.0f}–{band.most:.0f} % {band.name}")
            low = band.most
        found.append(_table("Go to pose under disturbances", pose_heads(), poses))
        found.append(f"behind the same controller's ideal row by {', '.join(parts)}")
    if paths:
        found.append(_table("Paths followed at 0.2 m/s", PATH_HEADS, paths))
    return [*found, *missing(document), *unmet(document), *notes(document), conclusion(document)]


def _table(title: str, heads: Sequence[str], lines: Sequence[Line]) -> Table:
    rows = [
        Row(
            (Entry(line.title), Entry(line.controller), *line.cells),
            line.kind,
            after is None or after.row != line.row,
        )
        for line, after in zip(lines, [*lines[1:], None], strict=True)
    ]
    kinds = {"published": "dim", "bound": "italic"}
    return Table(
        title,
        ("", "", *heads),
        rows,
        words=2,
        bands={band.name: band.terminal for band in BANDS},
        kinds=kinds,
    )


def conclusion(document: Mapping[str, Any]) -> str:
    """One sentence on what was required and met."""
    asked, met, open_ = document["asked"], document["met"], document["open"]
    return f"{met} of {asked} figures that are required are met" + (
        f"; {open_} could not be evaluated." if open_ else "."
    )


def notes(document: Mapping[str, Any]) -> list[str]:
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
