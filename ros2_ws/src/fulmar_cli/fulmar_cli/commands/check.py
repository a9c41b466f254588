"""`fulmar check`: check what a user has written before anything moves."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fulmar_bringup.console import log_line, print_json, write_line
from fulmar_cli.commands.arguments import JsonOption, argument, option
from fulmar_core.config.errors import FAILED

if TYPE_CHECKING:
    from fulmar_evaluation.robot_check import RobotCheck

check = typer.Typer(help="Check what you have written.", no_args_is_help=True, rich_markup_mode=None)


@check.callback()
def _group() -> None:
    """Makes a group of the only command."""


@check.command()
def robot(
    name: Annotated[str, argument("NAME|FILE", "A name from `fulmar list robots`, or a robot's .yaml file.")],
    plot: Annotated[
        Path | None,
        option(
            "FILE",
            "Draw forces and torques, or an aircraft's envelope, into a .png, .svg or .pdf.",
            "--plot",
        ),
    ] = None,
    speed: Annotated[float | None, option("M/S", "Of an aircraft: trim at this speed alone.")] = None,
    altitude: Annotated[
        float | None, option("M", "Of an aircraft: above mean sea level, for the density of the air.")
    ] = None,
    height: Annotated[
        float | None, option("M", "Of an aircraft: above ground or water, which switches ground effect on.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Check a robot: what its actuators can do to its body, and what looks like a mistake.

    Rank and limits of the wrench, whether nothing remains with every actuator on, controllability, the least time for a
    metre and a quarter turn, and values of the wrong unit. Of an aircraft: trim over speed and height, modes with their
    names, and what full controls do.

    Try:

    fulmar check robot navion --speed 53.64 --altitude 0

    fulmar check robot airship_v7 --height 1 --plot envelope.png

    Exit code: 0 passed, 1 it has a problem, 2 the file cannot be read.
    """
    from fulmar_evaluation.robot_check import check_robot

    if plot is not None:
        from fulmar_cli.installation.extras import require

        require("matplotlib")
        from fulmar_evaluation.report.writer import check_image

        check_image(plot)
    found = check_robot(name, speed=speed, altitude=altitude, height=height)
    if as_json:
        print_json(found.as_json())
    else:
        _show(found)
    if plot is not None and found.robot is not None:
        from fulmar_evaluation.report.by_kind import PLOTS

        log_line(f"wrote {PLOTS[found.robot.kind.name].of_check(found.robot, plot)}")
    if not found.passed:
        raise typer.Exit(FAILED)


def _show(found: RobotCheck) -> None:
    """Print a check for people."""
    if found.robot is not None and found.findings is not None:
        write_line(f"{found.name}: {found.robot.title}")
        for label, text in found.findings.lines():
            write_line(f"  {label:<24}{text}")
    for problem in found.problems:
        write_line(
            f"  problem: {problem}" if found.robot is not None else f"{found.name}: problem: {problem}"
        )
    write_line("passed" if found.passed else "not passed")
