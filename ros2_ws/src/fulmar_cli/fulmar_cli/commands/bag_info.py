"""`fulmar bag info`: topics, rates, gaps, what is late or missing, and where a bag comes from."""

from __future__ import annotations

from datetime import datetime
from typing import Any

import typer

from fulmar_bringup.console import output, print_json
from fulmar_cli.commands.arguments import BagArgument, JsonOption
from fulmar_core.errors import DONE, FAILED

HEAD = ("topic", "type", "count", "rate [Hz]", "gaps", "longest [s]", "late", "dropped")
NAMES = 2  # columns of words
ORIGIN = (
    "robot",
    "name",
    "task",
    "controller",
    "policy",
    "backend",
    "scenario",
    "seed",
    "control_hz",
    "command",
)


def info(bag: BagArgument, as_json: JsonOption = False) -> None:
    """Tell what is in a bag: topics, types, counts, rates, gaps, late and dropped messages, provenance.

    Rates and gaps go by the stamps in the messages where they have any, else by when they were recorded. A gap is 2.5
    periods without a message; a stamp of 0, which means "not set", counts for none. Late is a message that came more
    than a period later than usual. Dropped is what must have been there: numbers that the recorder counted and the
    file lacks, odometry that was answered but is not there.

    Exit code: 0 the whole bag was read, 1 part of it could not be, 2 nothing could.
    """
    from fulmar_bags.contents import open_bag
    from fulmar_bags.figures import describe

    found = describe(open_bag(bag))
    if as_json:
        print_json(found)
    else:
        _show(found)
    raise typer.Exit(FAILED if found["damage"] else DONE)


def _show(found: dict[str, Any]) -> None:
    when = _when(found["start_ns"])
    _say(
        f"{found['bag']}: {found['storage']}, {found['size_bytes'] / 1e3:.0f} kB, {found['messages']} messages, "
        f"{found['duration_s']:.2f} s" + (f" from {when}" if found["messages"] else "")
    )
    for row in _aligned([HEAD, *map(_row, found["topics"])]):
        _say(row)
    for topic in found["topics"]:
        if topic["unstamped"]:
            _say(
                f"{topic['name']}: {topic['unstamped']} of {topic['count']} messages have a stamp of 0 (not set)"
            )
    if found["silent_topics"]:
        _say(f"announced, without a message: {', '.join(found['silent_topics'])}")
    for fault in found["faults"]:
        _say(f"written for a fault at {_when(fault['time_ns'])}: {fault['reason']}")
    _show_origin(found["provenance"])
    for line in found["damage"]:
        _say(f"damage: {line}")


def _row(topic: dict[str, Any]) -> tuple[str, ...]:
    return (
        topic["name"],
        topic["type"].replace("/msg/", "/"),
        str(topic["count"]),
        _number(topic["rate_hz"], "{:.2f}"),
        str(topic["gaps"]),
        _number(topic["longest_gap_s"], "{:.3f}"),
        _number(topic["late"], "{}"),
        _number(topic["dropped"], "{}"),
    )


def _aligned(rows: list[tuple[str, ...]]) -> list[str]:
    """Rows as lines: names to the left, numbers to the right. Not folded, so that other programs can read them."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(
            f"{cell:<{width}}" if i < NAMES else f"{cell:>{width}}"
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        for row in rows
    ]


def _show_origin(origin: dict[str, Any]) -> None:
    if not origin["recorded_by_fulmar"]:
        _say("recorded by somebody else: it does not say which code, config and robot made it")
        return
    for key in ORIGIN:
        if origin[key] not in (None, ""):
            _say(f"{key}: {origin[key]}")
    _say(
        f"code: fulmar {origin['fulmar_version'] or 'unknown'}, revision {origin['git_revision'] or 'unknown'}"
    )
    if origin["made_by"]:
        _say(f"on {origin['made_by']['platform']}, Python {origin['made_by']['python']}")
    if origin["recorded_to_its_end"] is False:
        _say("the recorder did not come to an orderly end")
    if origin["controller_sha256"]:
        _say(f"controller SHA-256: {origin['controller_sha256']}")
    for name, sha256 in origin["attachments"].items():
        _say(f"carries {name}, SHA-256 {sha256[:16]}")
    if origin["config_changed_since"]:
        _say(f"changed here since then: {', '.join(origin['config_changed_since'])}")


def _when(time_ns: int) -> str:
    return datetime.fromtimestamp(time_ns / 1e9).strftime("%Y-%m-%d %H:%M:%S")


def _number(value: float | None, form: str) -> str:
    return "–" if value is None else form.format(value)


def _say(text: str) -> None:
    output.print(text, markup=False, soft_wrap=True)
