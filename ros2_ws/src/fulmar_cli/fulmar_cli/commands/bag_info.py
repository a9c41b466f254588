"""`fulmar bag info`: topics, rates, gaps, late and missing messages, and the origin of a bag."""

from __future__ import annotations

from datetime import datetime
from typing import Any

import typer

from fulmar_bags.bag_reading import BagReading
from fulmar_bringup.console import print_result, write_line
from fulmar_cli.commands.arguments import BagArgument, JsonOption
from fulmar_cli.commands.bag_reading import with_bag_options
from fulmar_core.config.errors import DONE, FAILED

HEAD = ("topic", "type", "count", "rate [Hz]", "gaps", "longest [s]", "late", "dropped")
NAMES = 2  # columns of words
ORIGIN = (
    "robot",
    "name",
    "task",
    "thing",
    "controller",
    "policy",
    "backend",
    "scenario",
    "seed",
    "control_hz",
    "command",
)


@with_bag_options()
def info(bag: BagArgument, as_json: JsonOption = False, *, reading: BagReading) -> None:
    """Show what is in a bag: topics, types, counts, rates, gaps, late and dropped messages, provenance.

    Rates and gaps go by the stamps in the messages where they have any, else by when they were recorded. A gap is 2.5
    periods without a message; a stamp of 0, which means "not set", counts for none. Late is a message that came more
    than a period later than usual. Dropped are messages that the recorder counted and the file lacks, and
    odometry that was answered but is not there. Images of cameras have a line with their size, kind, rate and room.

    Exit code: 0 the whole bag was read, 1 part of it could not be, 2 nothing could.
    """
    from fulmar_bags.contents import open_bag
    from fulmar_bags.figures import describe

    found = describe(open_bag(bag, reading))
    print_result(found, _show, as_json=as_json)
    raise typer.Exit(FAILED if found["damage"] else DONE)


def _show(found: dict[str, Any]) -> None:
    when = _when(found["start_ns"])
    write_line(
        f"{found['bag']}: {found['storage']}, {found['size_bytes'] / 1e3:.0f} kB, {found['messages']} messages, "
        f"{found['duration_s']:.2f} s" + (f" from {when}" if found["messages"] else "")
    )
    for row in _aligned([HEAD, *map(_row, found["topics"])]):
        write_line(row)
    for topic in found["topics"]:
        if topic["unstamped"]:
            write_line(
                f"{topic['name']}: {topic['unstamped']} of {topic['count']} messages have a stamp of 0 (not set)"
            )
    for line in (_frames(topic) for topic in found["topics"] if topic["frames"]):
        write_line(line)
    if found["silent_topics"]:
        write_line(f"announced, without a message: {', '.join(found['silent_topics'])}")
    for fault in found["faults"]:
        write_line(f"recorded around a fault at {_when(fault['time_ns'])}: {fault['reason']}")
    if fuel := found["fuel"]:
        left = "" if fuel["left_share"] is None else f", {100 * fuel['left_share']:.0f} % of the tank left"
        write_line(f"fuel: {1e3 * fuel['used_kg']:.1f} g used, impulse {fuel['impulse_N_s']:.1f} N·s{left}")
    _show_origin(found["provenance"])
    for name, origin in found["robots"].items():
        known = (
            f"{key} {origin[key]}"
            for key in ORIGIN[2:]
            if origin.get(key) not in (None, "") and key != "command"
        )
        write_line(f"{name}: {origin['robot']}, " + ", ".join(known))
    for line in found["damage"]:
        write_line(f"damage: {line}")


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


def _frames(topic: dict[str, Any]) -> str:
    """Size, kind and rate of the images of a topic, and what they take on the disk."""
    frames = topic["frames"]
    if "problem" in frames:
        return f"images that cannot be shown: {frames['problem']}"
    reach = f", up to {frames['reach_m']:.3g} m" if frames["reach_m"] else ""
    return (
        f"{topic['name']}: {topic['count']} images of {frames['width']} × {frames['height']}, {frames['kind']}{reach}, "
        f"{_number(topic['rate_hz'], '{:.2f}')} Hz, {topic['bytes'] / 1e6:.2f} MB, {frames['encoding'].strip()}"
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
        write_line("not recorded by Fulmar: code, config and robot are unknown")
        return
    for key in ORIGIN:
        if origin[key] not in (None, ""):
            write_line(f"{key}: {origin[key]}")
    write_line(
        f"code: fulmar {origin['fulmar_version'] or 'unknown'}, revision {origin['git_revision'] or 'unknown'}"
    )
    if origin["made_by"]:
        write_line(f"on {origin['made_by']['platform']}, Python {origin['made_by']['python']}")
    if origin["recorded_to_its_end"] is False:
        write_line("the recorder was not shut down in order")
    if origin["controller_sha256"]:
        write_line(f"controller SHA-256: {origin['controller_sha256']}")
    for name, sha256 in origin["attachments"].items():
        write_line(f"contains {name}, SHA-256 {sha256[:16]}")
    if origin["config_changed_since"]:
        write_line(f"changed here since then: {', '.join(origin['config_changed_since'])}")


def _when(time_ns: int) -> str:
    return datetime.fromtimestamp(time_ns / 1e9).strftime("%Y-%m-%d %H:%M:%S")


def _number(value: float | None, form: str) -> str:
    return "–" if value is None else form.format(value)
