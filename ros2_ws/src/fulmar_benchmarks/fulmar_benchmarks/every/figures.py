"""Figures of any benchmark's document, as rows: what is published or required, and what was measured."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

Row = dict[
    str, Any
]  # figure, ours, published, source, met; as `docs/benchmarks.json` has them, without command
PUBLISHED = ("published", "thesis")  # keys of what others report
MEASURED = ("measured", "value", "good", "coverage")  # keys of what stands beside a limit
NAMES = ("name", "what", "row", "controller", "figure", "quantity")  # keys that name a requirement
SOURCES = {
    "drift": "El-Hariry, Tables 3.5 and 3.6",
    "roboran": "El-Hariry, Table 4.7",
    "falcon": "thesis, Tables 5.7 and 5.8",
    "events": "thesis, Table 6.2",
}
OURS = {"success": "success_rate", "goals": "goals_in_1000_steps", "final_distance": "position_error_m"}
BARE = ("batch_steps_per_s", "ratio", "speed_ratio", "p50", "p99")  # figures that nothing is published about
UNNAMED = (
    "rows",
    "controllers",
    "pairs",
    "figures",
    "cells",
    "tasks",
    "robots",
    "checks",
)  # on the way to a figure
MORE_IS_BETTER = ("PT5", "PT2", "PT1", "OT5", "OT2", "OT1", "success", "goals")


def rows_of(document: dict[str, Any]) -> list[Row]:
    """Rows of a document: published figures beside ours, then requirements; else bare figures."""
    name = str(document.get("benchmark", ""))
    places = list(_places(document, ()))
    found = [row for path, each in places for row in _published(path, each, SOURCES.get(name, ""))]
    found += [row for path, each in places for row in _required(path, each)]
    if not found:
        found = [
            _row(_named((*path, key)), each[key], None, "", None)
            for path, each in places
            for key in BARE
            if isinstance(each.get(key), int | float)
        ]
    return found


def _places(value: Any, path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], dict[str, Any]]]:
    """Every object of a document with the names on the way to it."""
    if isinstance(value, dict):
        yield path, value
        for key, each in value.items():
            yield from _places(each, (*path, str(key)))
    elif isinstance(value, list):
        for each in value:
            kind = [
                str(each[key]) for key in ("robot", "task", "way") if isinstance(each, dict) and key in each
            ]
            yield from _places(each, (*path, *kind))


def _published(path: tuple[str, ...], each: dict[str, Any], source: str) -> Iterator[Row]:
    theirs = next((each[key] for key in PUBLISHED if isinstance(each.get(key), dict)), {})
    for figure, value in theirs.items():
        ours = _ours(figure, each)
        if isinstance(value, int | float) and not isinstance(value, bool) and ours is not None:
            met = ours >= value if figure in MORE_IS_BETTER else ours <= value
            yield _row(_named((*path, figure)), ours, value, source, met)


def _ours(figure: str, each: dict[str, Any]) -> float | None:
    """Our figure of that name: beside what is published, among the figures there, or of the first way of running."""
    ways = each.get("ways", {})
    for place in (each, each.get("figures", {}), *ways.values()):
        value = place.get(figure, place.get(OURS.get(figure, "")))
        value = value.get("mean") if isinstance(value, dict) else value
        if isinstance(value, int | float):
            return float(value)
    return None


def _required(path: tuple[str, ...], each: dict[str, Any]) -> Iterator[Row]:
    """A requirement says whether it is met, or passed; one without a limit is that of the whole part."""
    met = each.get("met", each.get("passed"))
    names = [str(each[key]) for key in NAMES if isinstance(each.get(key), str)]
    if "limit" in each and names:
        ours = next((each[key] for key in MEASURED if key in each), None)
        sign = {"more": "≥ ", "less": "≤ "}.get(str(each.get("better")), "")
        yield _row(", ".join(names), ours, f"{sign}{_text(each['limit'])}", "required", met)
    elif isinstance(each.get("passed"), bool) and path and "required" not in each:
        yield _row(_named(path), "passed" if met else "failed", "passed", "required", met)


def _row(figure: str, ours: Any, published: Any, source: str, met: bool | None) -> Row:
    return {
        "figure": figure,
        "ours": _text(ours),
        "published": _text(published),
        "source": source,
        "met": met,
    }


def _named(path: tuple[str, ...]) -> str:
    return ", ".join(
        part for part in path if part not in ("rows", "controllers", "pairs", "figures", "cells")
    )


def _text(value: Any) -> str:
    return "" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)
