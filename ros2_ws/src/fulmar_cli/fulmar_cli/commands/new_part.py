"""`fulmar new task|controller|driver|estimator|sensor`: the classes of the pages docs/own-*.md, with a test each."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fulmar_bringup.console import print_json, write_line
from fulmar_cli.commands.arguments import JsonOption, argument, option

NameArgument = Annotated[str, argument("NAME", "Of the module, such as dock_gate; its class is DockGate.")]
OutOption = Annotated[Path, option("DIR", "Folder to write into; where you are by default.")]
HELP = {
    "task": "Write a task of your own: starts, observation, errors, reward and success.",
    "controller": "Write a controller of your own: a command for each measured state.",
    "driver": "Write a driver of your own: commands to a device.",
    "estimator": "Write an estimator of your own: where the robot is, from what its sensors report.",
    "sensor": "Write a sensor of your own: what it measures of a simulated robot.",
}


def add_parts(new: typer.Typer) -> None:
    """Add a command for each kind of class."""
    for kind, text in HELP.items():
        _add(new, kind, text)


def _add(new: typer.Typer, kind: str, text: str) -> None:
    @new.command(kind, help=f"{text}\n\nTwenty to forty lines that run, and a test beside them.")
    def part(name: NameArgument, out: OutOption = Path(), as_json: JsonOption = False) -> None:
        from fulmar_evaluation.new_parts.new_part import make_part, write_part

        made = make_part(kind, name, out)
        write_part(made)
        files = [str(path) for path in made.files]
        if as_json:
            print_json({"class": made.path, "files": files, "next": list(made.then)})
            return
        write_line(f"wrote {', '.join(files)}: {made.path}; what is there to change: docs/{made.page}")
        for step in made.then:
            write_line(f"  {step}")
