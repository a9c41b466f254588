"""The document as rows of cells, and as tables in a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from fulmar_benchmarks.tables import NOTHING, Entry, Row, Shown, Table, display_name, number, tone_of

LAWS = {"lqr": "LQR", "polar": "polar law", "line_of_sight": "line of sight", "pure_pursuit": "pure pursuit"}
WAYS = {"batch": "batch", "mujoco": "MuJoCo", "ros": "ROS"}


@dataclass(frozen=True)
class Quantity:
    """One figure beside the thesis' own."""

    title: str
    unit: str
    figure: str  # of `fulmar_evaluation.figures`
    thesis: str  # key of an entry's `thesis`; empty: it has none
    digits: int
    factor: float = 1.0  # from our unit to this one


_COMMON = (Quantity("control deviation", "", "control_deviation", "control_variation", 2),)
_TO_A_PLACE = (
    Quantity("final distance", "m", "final_position_error_m", "final_distance", 3),
    Quantity("time to target", "s", "time_to_target_s", "time_to_target_s", 1),
    *_COMMON,
)
QUANTITIES = {
    "go_to_position": _TO_A_PLACE,
    "go_to_pose": (
        _TO_A_PLACE[0],
        Quantity("heading error", "°", "final_heading_error_deg", "heading_error", 2),
        *_TO_A_PLACE[1:],
    ),
    "track_velocities": (
        Quantity("velocity error", "m/s", "velocity_error_m_s", "velocity_error", 3),
        Quantity(
            "turn-rate error", "rad/s", "yaw_rate_error_deg_s", "yaw_rate_error", 3, 0.017453292519943295
        ),
        Quantity("settling time", "s", "settling_time_s", "", 1),
        *_COMMON,
    ),
    "go_through_positions": (
        Quantity("goals in 60 s", "", "goals_reached", "", 2),
        Quantity("bound in 60 s", "", "goals_bound", "", 2),
        Quantity("bound at top speed in 60 s", "", "goals_at_top_speed", "", 2),
        Quantity("share of that", "", "share_at_top_speed", "", 3),
        Quantity("goals in 1,000 steps", "", "goals_in_1000_steps", "goals", 2),
        Quantity("goals in 100 s", "", "goals_in_100_s", "goals", 2),
        *_COMMON,
    ),
    "go_to_position_with_obstacles": (
        _TO_A_PLACE[0],
        Quantity("collided", "", "collided", "", 3),
        *_TO_A_PLACE[1:],
    ),
}


def head(entry: dict[str, Any]) -> str:
    """Title of a pair's column."""
    name = display_name(entry["robot"])
    if entry["kind"] == "policy":
        return name
    return f"{name}, {entry['kind'] if entry['law'] is None else LAWS.get(entry['law'], 'classical')}"


def missing(entry: dict[str, Any]) -> str:
    """Why a pair has no figures, or not all; empty where nothing is missing."""
    return "" if entry["status"] == "judged" else f"{head(entry)}: {entry['status']}: {entry['reason']}"


def rows(task: str, entries: list[dict[str, Any]]) -> list[Row]:
    """Every quantity of a task, a cell for each pair; figures are means of its first way."""
    figure = "share of the bound" if task == "go_through_positions" else "success"
    ways = [way for way in WAYS if any(way in entry["ways"] for entry in entries)]
    table = [_row(f"{figure}, {WAYS[way]}", (_evaluated(entry, way) for entry in entries)) for way in ways]
    table += [
        _row("required", (_required(entry) for entry in entries)),
        _row("thesis: success", (_thesis_success(entry) for entry in entries)),
        _row("batch and MuJoCo apart by", (_gap(entry) for entry in entries)),
        _row(
            "batch, of MuJoCo's episodes",
            (Entry(number(entry["judged_in_batch_on_mujocos_episodes"], 3)) for entry in entries),
        ),
        _row("trained in, on two cores", (_training(entry) for entry in entries)),
    ]
    for quantity in QUANTITIES.get(task, _COMMON):
        unit = f" [{quantity.unit}]" if quantity.unit else ""
        table.append(_row(quantity.title + unit, (_beside(entry, quantity) for entry in entries)))
    return [row for row in table if any(cell.text not in ("", NOTHING) for cell in row.entries[1:])]


def _row(title: str, entries: Iterable[Entry]) -> Row:
    return Row((Entry(title), *entries))


def _checks(entry: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {check["name"]: check for check in entry["verdicts"]}


def _met(entry: dict[str, Any], name: str) -> bool | None:
    """Whether a requirement is met; None: it was not measured, or there is none."""
    met: bool | None = _checks(entry).get(name, {}).get("met")
    return met


def _evaluated(entry: dict[str, Any], way: str) -> Entry:
    return Entry(number(entry["judged"].get(way), 3), tone_of(_met(entry, way)))


def _required(entry: dict[str, Any]) -> Entry:
    check = _checks(entry).get("batch")
    return Entry("" if check is None else f"≥ {check['limit']:.2f}")


def _thesis_success(entry: dict[str, Any]) -> Entry:
    thesis = entry["thesis"]
    return Entry(
        "" if thesis["success"] is None else f"{thesis['success']:.2f} ± {thesis['success_std']:.2f}"
    )


def _gap(entry: dict[str, Any]) -> Entry:
    check = _checks(entry).get("batch_minus_mujoco")
    if check is None and {"batch", "mujoco"} <= set(entry["judged"]):
        return Entry(number(abs(entry["judged"]["batch"] - entry["judged"]["mujoco"]), 3))
    return Entry(
        number(None if check is None else check["measured"], 3), tone_of(_met(entry, "batch_minus_mujoco"))
    )


def _training(entry: dict[str, Any]) -> Entry:
    ours, theirs = entry["training_s"], entry["thesis"]["training_min"]
    if ours is None:
        return Entry(NOTHING)
    text = f"{ours:.0f} s" if theirs is None else f"{ours:.0f} s ({60.0 * theirs:.0f} s)"
    return Entry(text, tone_of(_met(entry, "training_s")))


def _beside(entry: dict[str, Any], quantity: Quantity) -> Entry:
    way: dict[str, Any] = next(iter(entry["ways"].values()), {})
    mean = way.get(quantity.figure, {}).get("mean")
    if mean is None:
        return Entry(NOTHING)
    ours, theirs = number(quantity.factor * mean, quantity.digits), entry["thesis"].get(quantity.thesis)
    return Entry(ours if theirs is None else f"{ours} ({theirs:.{min(quantity.digits, 2)}f})")


_PLACES = {"batch": "the batch", "mujoco": "MuJoCo", "ros": "ROS"}


def shown(document: Mapping[str, Any]) -> list[Shown]:
    """One table a task, what the figures are, and the conclusion."""
    found: list[Shown] = []
    for task in dict.fromkeys(entry["task"] for entry in document["pairs"]):
        entries = [entry for entry in document["pairs"] if entry["task"] == task]
        some = [entry for entry in entries if entry["ways"]]
        found += [Table(display_name(task), ("", *map(head, some)), rows(task, some))] if some else []
        found += [f"{display_name(task)}, {missing(entry)}" for entry in entries if missing(entry)]
    return [*found, *notes(document), conclusion(document)]


def conclusion(document: Mapping[str, Any]) -> str:
    """One sentence on what was required and met."""
    asked, met, open_ = document["asked"], document["met"], document["open"]
    return f"{met} of {asked} pairs meet every requirement" + (
        f"; {open_} could not be evaluated in full." if open_ else "."
    )


def notes(document: Mapping[str, Any]) -> list[str]:
    """What one has to know to read the tables."""
    ways = ", ".join(
        f"{episodes:,} episodes in {_PLACES[way]}" for way, episodes in document["episodes"].items()
    )
    lines = [
        f"{ways}; scenario {document['scenario']}, seed {document['seed']}. In brackets: the thesis (Tables 4.6 and "
        "4.7, its times from control steps at 10 Hz; its control variation is another sum). Figures below the line of "
        "training are means over the episodes of the first way."
    ]
    seen: dict[str, str] = {}
    for entry in document["pairs"]:
        for way in entry["ways"].values():
            if "bound" in way:
                seconds = f"1,000 steps are {way['thousand_steps_s']:g} s"
                seen[display_name(entry["robot"])] = f"{way['bound']}; {seconds} at {way['control_hz']:g} Hz"
    lines += [f"bound for {robot}: {rule}." for robot, rule in seen.items()]
    compared = [entry for entry in document["pairs"] if entry["same_at_64_worlds"] is not None]
    if compared:
        same = sum(entry["same_at_64_worlds"] for entry in compared)
        lines.append(
            f"{same} of {len(compared)} pairs give the same numbers, bit for bit, in small batches as in large ones."
        )
    return lines
