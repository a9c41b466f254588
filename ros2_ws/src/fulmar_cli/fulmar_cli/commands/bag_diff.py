"""`fulmar bag diff`: what differs between two bags."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from fulmar_bringup.console import output, print_json
from fulmar_cli.commands.arguments import BagArgument, JsonOption
from fulmar_cli.commands.damage import finish, open_and_warn

SHOWN = 6  # fields of a topic


def diff(
    bag: BagArgument,
    other: Annotated[Path, typer.Argument(metavar="OTHER", help="The bag to compare it with.")],
    tolerance: Annotated[
        float, typer.Option(metavar="X", min=0.0, help="Largest difference that counts as the same.")
    ] = 0.0,
    topic: Annotated[
        list[str] | None,
        typer.Option(metavar="TOPIC", help="Compare this topic alone; may be repeated."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Compare two bags, field by field of every topic, and name what differs first.

    Messages belong together by the stamps in them. Clock, status and diagnostics tell of the machine and differ always;
    name them with --topic to see how. Two lock-step runs of one seed are the same.

    Messages that cannot be read are compared byte by byte.

    Exit code: 0 the same, 1 something differs or there is nothing to compare or part of a bag could not be read, 2 a
    bag cannot be read.
    """
    from fulmar_bags.comparison import differing

    bags = [open_and_warn(bag), open_and_warn(other)]
    found = differing(*bags, tolerance=tolerance, only=topic)
    if as_json:
        print_json(found)
    else:
        _show(found)
    raise finish(*bags, good=found["same"])


def _show(found: dict[str, Any]) -> None:
    for key, (before, after) in found["provenance"].items():
        _say(f"{key}: {before} | {after}")
    for topic in found["topics"]:
        one, two = topic["counts"]
        _say(f"{topic['topic']}: {'the same' if topic['same'] else 'differs'} ({one} | {two} messages)")
        if "types" in topic:
            _say(f"  types: {topic['types'][0]} | {topic['types'][1]}")
        for side, count in (("first", topic["only_first"]), ("second", topic["only_second"])):
            if count:
                _say(f"  {count} messages are in the {side} bag alone")
        for each in topic["fields"][:SHOWN]:
            _say(
                f"  {each['name']}: {each['differing']} of {each['compared']} differ, first at t = "
                f"{each['first_stamp_s']:.3f} s: {each['recorded']} | {each['found']}; "
                f"largest {each['difference']['max'] if each['difference'] else 0.0:.3g}"
            )
        rest = len(topic["fields"]) - SHOWN
        if rest > 0:
            _say(f"  ... and {rest} more fields; --json has them all")
        for each in topic["texts"]:
            _say(f"  {each['field']}: {each['differing']} messages differ in it")
        if topic["bytes"]:
            _say(f"  {topic['bytes']} messages differ; they cannot be read, and were compared byte by byte")
    if not found["compared"]:
        _say("the bags have no messages to compare")
    _say("same" if found["same"] else "different")


def _say(text: str) -> None:
    output.print(text, markup=False, soft_wrap=True)
