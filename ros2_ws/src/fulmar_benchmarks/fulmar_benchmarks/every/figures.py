"""Figures of any benchmark's document, as rows: what is published or required, and what was measured."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

Row = dict[str, Any]  # figure, ours, published, source, met, as texts: a row of `page_of`, without command
Place = tuple[tuple[str, ...], dict[str, Any]]  # an object of a document, and the names on the way to it
SOURCES = {
    "drift": "El-Hariry, Tables 3.5 and 3.6",
    "roboran": "El-Hariry, Table 4.7",
    "falcon": "thesis, Tables 5.7 and 5.8",
}
# Our names of what is published by other names, in a way of running.
OURS = {"success": "success_rate", "goals": "goals_in_1000_steps"}
MORE_IS_BETTER = ("PT5", "PT2", "PT1", "OT5", "OT2", "OT1", *OURS)
LIMITS = {  # keys of limits, and of what stands beside
    "limit": ("measured", "value", "good"),
    "required": ("share",),
    "most_error_percent": ("worst_error_percent",),
    "rmse_share_limit": ("rmse_share",),
}
NAMES = (
    "name",
    "what",
    "row",
    "controller",
    "figure",
    "quantity",
    "hardware",
    "pose_rate_hz",
)  # of a requirement
ON_THE_WAY = ("robot", "task")  # keys that tell the entries of a list apart
UNNAMED = ("rows", "controllers", "pairs", "figures", "cells", "tasks", "robots", "required")
BARE = (
    "batch_steps_per_s",
    "ratio",
    "speed_ratio",
    "p50",
    "p99",
    "worst_error_percent",
)  # with nothing beside them


def rows_of(document: dict[str, Any]) -> list[Row]:
    """Rows of a document: published figures beside ours, then requirements; else parts that passed, or bare figures."""
    places = list(_places(document, ()))
    source = SOURCES.get(document.get("benchmark", ""), "published")
    checks = document.get("checks")  # every requirement of a benchmark of the one shape, once
    asked = places if checks is None else _places(checks, ())
    required = [row for place in asked for row in _required(*place)]
    if not required:
        required = [
            _row(
                path or ("all of it",),
                "passed" if each["passed"] else "failed",
                "passed",
                "required",
                each["passed"],
            )
            for path, each in places
            if isinstance(each.get("passed"), bool)
            and (path or not any("passed" in one for _, one in places[1:]))
        ]
    found = [row for place in places for row in _published(*place, source)] + required
    bare = [(path, key, each[key]) for path, each in places for key in BARE if _is_number(each.get(key))]
    return found or [_row((*path, key), value, None, "", None) for path, key, value in bare]


def _places(value: Any, path: tuple[str, ...]) -> Iterator[Place]:
    if isinstance(value, dict):
        yield path, value
        for key, each in value.items():
            yield from _places(each, (*path, str(key)))
    elif isinstance(value, list):
        for each in value:
            named = [str(each[key]) for key in ON_THE_WAY if key in each] if isinstance(each, dict) else []
            yield from _places(each, (*path, *named))


def _published(path: tuple[str, ...], each: dict[str, Any], source: str) -> Iterator[Row]:
    theirs = each.get("published") or each.get("thesis")
    for figure, value in theirs.items() if isinstance(theirs, dict) else ():
        ours = _ours(figure, each)
        if _is_number(value) and ours is not None:
            met = ours >= value if figure in MORE_IS_BETTER else ours <= value
            yield _row((*path, figure), ours, value, source, met)


def _ours(figure: str, each: dict[str, Any]) -> float | None:
    """Our figure beside a published one: in the same object, among its figures, or of the first way of running."""
    for place in (each, each.get("figures", {}), *each.get("ways", {}).values()):
        value: Any = place.get(figure, place.get(OURS.get(figure, "")))
        value = value.get("mean") if isinstance(value, dict) else value
        if _is_number(value):
            return float(value)
    return None


def _required(path: tuple[str, ...], each: dict[str, Any]) -> Iterator[Row]:
    met = each.get("met", each.get("passed"))
    names = [
        f"{each[key]:g} Hz" if _is_number(each[key]) else str(each[key]) for key in NAMES if key in each
    ] or [*path]
    for limit, keys in LIMITS.items():
        if _is_number(each.get(limit)):
            key = next((key for key in keys if key in each), keys[0])
            ours = each["good"] / max(each["flights"], 1) if key == "good" else each.get(key)
            sign = {"more": "≥ ", "less": "≤ "}.get(each.get("better", ""), "")
            yield _row(
                (*(names or path), *([key] if limit != "limit" else [])),
                ours,
                sign + _text(each[limit]),
                "required",
                met,
            )


def _row(path: tuple[str, ...], ours: Any, published: Any, source: str, met: bool | None) -> Row:
    figure = ", ".join(part for part in path if part not in UNNAMED)
    return {
        "figure": figure,
        "ours": _text(ours),
        "published": _text(published),
        "source": source,
        "met": met,
    }


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _text(value: Any) -> str:
    return "" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)
