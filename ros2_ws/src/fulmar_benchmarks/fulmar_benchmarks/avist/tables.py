"""The document as tables in a terminal and on its page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from fulmar_benchmarks.avist.generalists import MOST_BEHIND, behind
from fulmar_benchmarks.avist.targets import CONTROLLERS, FOLLOW
from fulmar_benchmarks.shape import Check
from fulmar_benchmarks.tables import Entry, Row, Shown, Table, display_name, number, tone_of

HEADS = (
    "success",
    "distance [m]",
    "attitude [°]",
    "velocity [m/s]",
    "turn rate [°/s]",
    "duty",
    "updates",
    "cpu s",
)
SHOWN = (
    ("success_rate", 3), ("position_error_m", 3), ("attitude_error_deg", 1), ("velocity_error_m_s", 3),
    ("rate_error_deg_s", 1), ("duty", 2), ("updates", 0), ("cpu_s", 0),
)  # fmt: skip
INSPECTED = (
    "success",
    "path error [m]",
    "largest [m]",
    "pointing [°]",
    "from keep-out [m]",
    "coverage",
    "possible",
)
WHO = ("generalist", "single")


def tasks_of(document: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Figures by task and controller."""
    policies = document["policies"]
    return {
        task: each | ({"policy": policies[task]} if task in policies else {})
        for task, each in document["laws"].items()
    }


def shown(document: Mapping[str, Any], checks: Sequence[Check]) -> list[Shown]:
    """Tasks, inspections and generalists."""
    return [
        *_tasks(document, checks),
        *_inspections(document["inspect"]),
        *_generalists(document["generalists"]),
    ]


def _tasks(document: Mapping[str, Any], checks: Sequence[Check]) -> list[Shown]:
    """One row for each controller at each task, and why some could not be evaluated."""
    met = {check.name: check.met for check in checks}
    places = [
        (task, by, each[by]) for task, each in tasks_of(document).items() for by in CONTROLLERS if by in each
    ]
    places += [(f"{FOLLOW}, live", "policy", document["live"])] if document["live"] else []
    if not places:
        return []
    rows = [
        Row(
            (
                Entry(display_name(task)),
                Entry(by),
                Entry(number(each["success_rate"], 3), tone_of(met.get(f"{task}, {by}: success"))),
                *(Entry(number(each.get(key), digits)) for key, digits in SHOWN[1:]),
            )
        )
        for task, by, each in places
    ]
    missing = [f"{display_name(task)}, {by}: {each['reason']}" for task, by, each in places if each["reason"]]
    return [Table(display_name(document["robot"]), ("", "", *HEADS), rows, words=2), *missing]


def _inspections(found: Mapping[str, Any]) -> list[Shown]:
    """A table for each thing, a row for each path and controller, and why some were not flown."""
    tables: list[Shown] = []
    for thing, paths in found.items():
        flown = [(path, by, one) for path, each in paths.items() for by, one in each.items()]
        rows = [_round(path, by, one) for path, by, one in flown if one["reason"] is None]
        tables += [Table(f"inspect {display_name(thing)}", ("", "", *INSPECTED), rows, words=2)] * bool(rows)
        tables += [
            f"{display_name(thing)}, {path}, {by}: {one['reason']}"
            for path, by, one in flown
            if one["reason"]
        ]
    return tables


def _round(path: str, by: str, one: Mapping[str, Any]) -> Row:
    error = one["path_error_m"]
    figures = (
        (one["success_rate"], 3), (error["mean"], 4), (error["max"], 3), (one["pointing_error_deg"]["mean"], 2),
        (one["least_distance_m"], 2), (one["coverage"], 2), (one["coverage_possible"], 2),
    )  # fmt: skip
    return Row((Entry(path), Entry(by), *(Entry(number(value, digits)) for value, digits in figures)))


def _generalists(found: Mapping[str, Any] | None) -> list[Shown]:
    """A row for each path and each body, and how far the generalists are behind."""
    if found is None:
        return []
    paths = []
    for path, each in found["paths"].items():
        pairs = [each.get(by, {}).get(key) for key in ("success_rate", "path_error_m") for by in WHO]
        paths.append(Row((Entry(path), *(Entry(number(value, 3)) for value in pairs))))
    bodies = [
        Row((Entry(body), *(Entry(number(each.get(by), 3)) for by in WHO)))
        for body, each in found["bodies"].items()
    ]
    return [
        Table(
            "one policy for all paths, beside one each", ("", *WHO, "its path error [m]", "theirs [m]"), paths
        ),
        Table("one policy for any body, beside one each: success", ("", *WHO), bodies),
        *(f"{name}: {each['error']}" for name, each in found["learning"].items() if "error" in each),
        *(
            f"aim: the generalist of {kind} succeeds at most {MOST_BEHIND:g} less often: {number(value, 3)}"
            for kind, value in behind(found).items()
        ),
    ]
