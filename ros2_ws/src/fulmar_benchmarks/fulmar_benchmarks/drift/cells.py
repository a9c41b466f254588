"""The document as rows of cells: one definition for terminals and pages."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from fulmar_benchmarks.cells import NOTHING, tone_of
from fulmar_benchmarks.drift.targets import DIGITS, FIGURES

DISPLAY_NAMES = {"policy": "policy", "lqr": "LQR", "lqr_drift": "LQR of DRIFT", "mpc": "MPC"}
UNITS = {**{name: "%" for name in FIGURES if name[1] == "T"}, "ALV": "m/s", "AAV": "rad/s", "AAS": ""}


@dataclass(frozen=True)
class Cell:
    """What is written, how it compares with what is required, and how far it falls behind ideal conditions."""

    text: str
    tone: str = ""  # GOOD, BAD, or nothing required
    band: str = ""  # name of a `targets.Band`, or nothing to compare with


@dataclass(frozen=True)
class Line:
    """One controller in one row."""

    row: str
    title: str  # of the row, on its first line only
    controller: str
    cells: tuple[Cell, ...]
    # ours; feasible: of the episodes whose pose can be held; published; bound: what physics allows
    kind: str = "ours"


def display_name(controller: str) -> str:
    """Name of a controller in tables and reports."""
    return DISPLAY_NAMES.get(controller, controller.replace("_", " "))


def pose_lines(document: dict[str, Any]) -> list[Line]:
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
                able = tuple(Cell(_written(figure, where[figure]["mean"])) for figure in FIGURES)
                lines.append(Line(name, "", f"feasible {100.0 * share:.0f} %", able, "feasible"))
            beside = entry["published_controller"]
            theirs = tuple(_theirs(entry, figure) for figure in FIGURES)
            lines.append(Line(name, "", f"DRIFT's {beside}", theirs, "published"))
        most = tuple(
            Cell(f"{row['bound'][figure]['mean']:.1f}" if figure in row["bound"] else "")
            for figure in FIGURES
        )
        lines.append(Line(name, "", "bound", most, "bound"))
    return lines


def path_lines(document: dict[str, Any]) -> list[Line]:
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
                Cell(_spread(entry, "velocity_error", 3), tone),
                Cell(_spread(entry, "velocity_error_under_way", 3)),
                Cell(_spread(entry, "path_error", 3)),
                Cell(_mean(entry, "path_error_most", 3)),
                Cell(_mean(entry, "AAS", 2)),
            )
            lines.append(Line(name, title, display_name(controller), cells))
            title = ""
        published = row["published"]
        text = f"{published['velocity_error']:.2f} ± {published['velocity_error_std']:.2f}"
        empty = (Cell(""),) * 4
        lines.append(Line(name, "", "DRIFT's RL", (Cell(text), *empty), "published"))
    return lines


PATH_HEADS = ("velocity error [m/s]", "under way [m/s]", "off the path [m]", "at most [m]", "AAS")


def pose_heads() -> tuple[str, ...]:
    """Titles of the columns of `pose_lines`."""
    return tuple(f"{name} [{UNITS[name]}]" if UNITS[name] else name for name in FIGURES)


def unmet(document: dict[str, Any]) -> list[str]:
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


def missing(document: dict[str, Any]) -> list[str]:
    """Who did not drive, and why; each reason once."""
    found = {
        f"{display_name(controller)}: {entry['status']}: {entry['reason']}": None
        for row in document["rows"].values()
        for controller, entry in row["controllers"].items()
        if entry["status"] != "judged"
    }
    return list(found)


def _tones(document: dict[str, Any]) -> dict[tuple[str, str, str], str]:
    return {
        (check["row"], check["controller"], check["figure"]): tone_of(check["met"])
        for check in document["requirements"]
    }


def _ours(entry: dict[str, Any], figure: str, tone: str) -> Cell:
    if not entry["figures"]:
        return Cell(NOTHING)
    drop = entry.get("drops", {}).get(figure)
    return Cell(_written(figure, entry["figures"][figure]["mean"]), tone, drop["band"] if drop else "")


def _theirs(entry: dict[str, Any], figure: str) -> Cell:
    drop = entry["published_drops"][figure]
    return Cell(_written(figure, entry["published"][figure]), "", drop["band"] if drop else "")


def _written(figure: str, value: float) -> str:
    return f"{value:.{DIGITS[figure]}f}"


def _spread(entry: dict[str, Any], figure: str, digits: int) -> str:
    if not entry["figures"]:
        return NOTHING
    mean, std = entry["figures"][figure]["mean"], entry["figures"][f"{figure}_std"]["mean"]
    return f"{mean:.{digits}f} ± {std:.{digits}f}"


def _mean(entry: dict[str, Any], figure: str, digits: int) -> str:
    return f"{entry['figures'][figure]['mean']:.{digits}f}" if entry["figures"] else NOTHING
