"""`fulmar bag reference`: runs that every later version must answer the same way."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from fulmar_bringup.console import log_line, print_json, write_line
from fulmar_cli.commands.arguments import JsonOption, argument, flag, option
from fulmar_core.config.errors import DONE, FAILED, UnknownNameError


def reference(
    folder: Annotated[Path, argument("FOLDER", "Where the reference bags are.")] = Path("tests/replay/bags"),
    update: Annotated[
        bool, flag("--update", "Record them anew through the deployed nodes; an intended change.")
    ] = False,
    only: Annotated[list[str] | None, option("NAME", "This one alone; may be repeated.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Check that the reference bags are answered as they were recorded, or record them anew.

    Each is a short lock-step run. It is run again from its odometry: the gates decide, observations are made, the
    controller acts, commands are limited. Each difference beyond the rounding of another processor is shown with its
    field and its step.

    Exit code: 0 all are the same, or were recorded; 1 something differs.
    """
    from fulmar_bags.comparison import as_json as lines
    from fulmar_bags.comparison import first_difference
    from fulmar_evaluation.rerun.reference_bags import REFERENCES, check_reference, record_reference

    known = {each.name: each for each in REFERENCES}
    for name in only or ():
        if name not in known:
            raise UnknownNameError("reference", name, known)
    results: list[dict[str, Any]] = []
    for name in only or list(known):
        if update:
            log_line(f"recording {name}")
            record_reference(known[name], folder)
        fields = check_reference(folder / name)
        first = first_difference(fields)
        results.append(
            {"name": name, "same": first is None, "first_difference": lines([first])[0] if first else None}
        )
        if not as_json:
            where = (
                "the same"
                if first is None
                else f"differs from step {first.first_step} on: {first.field} {first.name}, "
                f"recorded {first.recorded}, now {first.found}"
            )
            write_line(f"{name}: {where}")
    same = all(result["same"] for result in results)
    if as_json:
        print_json({"references": results, "same": same})
    raise typer.Exit(DONE if same else FAILED)
