"""`fulmar bag export`: bags for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fulmar_bringup.console import output, print_json
from fulmar_cli.commands.arguments import JsonOption
from fulmar_cli.commands.damage import finish, open_and_warn, warn
from fulmar_core.errors import BagError, ConfigError, UnknownNameError

FORMATS = ("csv", "npz", "lerobot")


def export(
    bags: Annotated[list[Path], typer.Argument(metavar="BAG...", help="Bags; several only for lerobot.")],
    to: Annotated[
        str,
        typer.Option(
            "--to",
            metavar="csv|npz|lerobot",
            help="csv: a table for each topic. npz: NumPy arrays, one for each field. lerobot: a dataset, one episode "
            "for each bag, one frame for each control step.",
        ),
    ] = "csv",
    out: Annotated[
        Path | None, typer.Option(metavar="PATH", help="Folder, or the .npz file; beside the bag by default.")
    ] = None,
    task: Annotated[
        str | None,
        typer.Option(metavar="T", help="Task of the bags, for a dataset, where it is a class of your own."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Write what is in a bag as CSV, as NumPy arrays, or as a dataset to learn from.

    The dataset follows version 2.1 of LeRobot's format: `meta/info.json`, tasks, episodes and their statistics as JSON
    lines, and a parquet file for each episode, with `observation.state` and `action` as the controller saw and said
    them. It needs the extra 'datasets'.
    """
    from fulmar_bags.tables import write_csv, write_npz

    if to not in FORMATS:
        raise UnknownNameError("--to", to, FORMATS)
    if len(bags) > 1 and to != "lerobot":
        raise ConfigError(f"--to {to} takes one bag, {len(bags)} were given. Export them one by one.")
    opened = [open_and_warn(bag) for bag in bags]
    beside = bags[0] if bags[0].is_dir() else bags[0].parent
    if to == "csv":
        files, left_out = write_csv(opened[0], out or beside / "csv")
    elif to == "npz":
        path = out or beside / f"{beside.resolve().name}.npz"
        file, left_out = write_npz(opened[0], path.with_suffix(".npz"))
        files = [file]
    else:
        from fulmar_bags.control_steps import control_steps_of
        from fulmar_bags.lerobot import write_lerobot

        for bag in opened:
            if bag.info is None:
                raise BagError(
                    f"{bag.path}: others recorded it, without the observations of a controller. Use --to csv or npz."
                )
        courses = [control_steps_of(bag, task=task) for bag in opened]
        titles = [course.task.title for course in courses]
        folder, notes = write_lerobot(courses, titles, out or beside / "lerobot")
        files, left_out = [folder], []
        warn(notes)
    warn(f"left out: {line}" for line in left_out)
    if as_json:
        names = [str(file) for file in files]
        print_json({"bags": [str(bag) for bag in bags], "to": to, "files": names, "left_out": left_out})
    else:
        for file in files:
            output.print(str(file), markup=False, soft_wrap=True)
    raise finish(*opened)
