"""`fulmar bag diff`: differences between two bags."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from fulmar_bringup.console import log_line, print_result, write_line
from fulmar_cli.commands.arguments import BagArgument, JsonOption, argument, option
from fulmar_cli.commands.damage import finish, open_and_warn

SHOWN = 6  # fields of a topic


def diff(
    bag: BagArgument,
    other: Annotated[Path, argument("OTHER", "The bag to compare it with.")],
    tolerance: Annotated[float, option("X", "Largest difference that counts as the same.", min=0.0)] = 0.0,
    topic: Annotated[list[str] | None, option("TOPIC", "Compare this topic alone; may be repeated.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Compare two bags, field by field of every topic, and name what differs first.

    Messages belong together by the stamps in them. Clock, status and diagnostics differ always;
    name them with --topic to see how. Two lock-step runs of one seed are the same.

    Messages that cannot be read are compared byte by byte.

    Exit code: 0 the same, 1 something differs or there is nothing to compare or part of a bag could not be read, 2 a
    bag cannot be read.
    """
    from fulmar_bags.comparison import differing

    bags = [open_and_warn(bag), open_and_warn(other)]
    found = differing(*bags, tolerance=tolerance, only=topic)
    print_result(found, _show, as_json=as_json)
    if not as_json and all(each.info for each in bags):
        log_line(f"to compare the two runs: fulmar report {bag} {other}")
    raise finish(*bags, good=found["same"])


def _show(found: dict[str, Any]) -> None:
    for key, (before, after) in found["provenance"].items():
        write_line(f"{key}: {before} | {after}")
    for topic in found["topics"]:
        one, two = topic["counts"]
        write_line(f"{topic['topic']}: {'the same' if topic['same'] else 'differs'} ({one} | {two} messages)")
        if "types" in topic:
            write_line(f"  types: {topic['types'][0]} | {topic['types'][1]}")
        for side, count in (("first", topic["only_first"]), ("second", topic["only_second"])):
            if count:
                write_line(f"  {count} messages are in the {side} bag alone")
        for each in topic["fields"][:SHOWN]:
            write_line(
                f"  {each['name']}: {each['differing']} of {each['compared']} differ, first at t = "
                f"{each['first_stamp_s']:.3f} s: {each['recorded']} | {each['found']}; "
                f"largest {each['difference']['max'] if each['difference'] else 0.0:.3g}"
            )
        rest = len(topic["fields"]) - SHOWN
        if rest > 0:
            write_line(f"  ... and {rest} more fields; --json has them all")
        for each in topic["texts"]:
            write_line(f"  {each['field']}: {each['differing']} messages differ in it")
        if topic["bytes"]:
            write_line(
                f"  {topic['bytes']} messages differ; they cannot be read, and were compared byte by byte"
            )
    if not found["compared"]:
        write_line("the bags have no messages to compare")
    write_line("same" if found["same"] else "different")
