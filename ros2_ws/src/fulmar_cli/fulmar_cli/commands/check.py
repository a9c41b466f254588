"""`fulmar check`: check what a user has written before anything moves."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

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
            "FILE", "Draw forces and torques, or an aircraft's envelope, into this image (.png).", "--plot"
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
    found = check_robot(name, speed=speed, altitude=altitude, height=height)
    if as_json:
        print_json(found.as_json())
    else:
        _show(found)
    if plot is not None and found.aircraft is not None:
        from fulmar_evaluation.report.envelope_plot import write_envelope_plot

        log_line(f"wrote {write_envelope_plot(found.aircraft.robot, plot)}")
    if plot is not None and found.robot is not None and found.wrenches is not None:
        from fulmar_evaluation.report.wrench_plot import write_wrench_plot

        log_line(f"wrote {write_wrench_plot(found.robot, found.wrenches, plot)}")
    if not found.passed:
        raise typer.Exit(FAILED)


def _show(found: RobotCheck) -> None:
    """Print a check for people."""
    from fulmar_evaluation.aircraft_check import lines_of

    result = found.as_json()
    if found.robot is not None:
        write_line(f"{found.name}: {found.robot.title}")
        flown = found.aircraft
        for label, text in _lines(found, result) if flown is None else lines_of(flown):
            write_line(f"  {label:<24}{text}")
    for problem in found.problems:
        write_line(f"  problem: {problem}" if found.robot is not None else f"{found.name}: {problem}")
    write_line("passed" if found.passed else "not passed")


def _lines(found: RobotCheck, result: dict[str, Any]) -> list[tuple[str, str]]:
    actuators, wrench, least = result["actuators"], result["wrench"], result["least_time"]
    rank = f"{actuators['count']}, rank {actuators['rank']} of {len(actuators['axes'])}"
    if actuators["missing_axes"]:
        rank += f", without {', '.join(actuators['missing_axes'])}"
    shared = " (a shared pressure line)" if wrench["shared_line"] else ""
    lines = [
        ("actuators", rank),
        ("pure force", _xyz(wrench["force_range_n"], "N") + shared),
        ("pure torque", _xyz(wrench["torque_range_nm"], "N·m") + shared),
    ]
    if wrench["shared_line"]:
        alone = wrench["without_shared_line"]
        lines.append(
            (
                "  each by itself",
                f"{_xyz(alone['force_range_n'], 'N')}; {_xyz(alone['torque_range_nm'], 'N·m')}",
            )
        )
    if "force_n_about_com" in wrench:
        lines.append(("  no torque about CoM", _xyz(wrench["force_range_n_about_com"], "N")))
    return [
        *lines,
        ("zero wrench, all on", "holds" if result["zero_wrench_holdable"] else "does not hold"),
        ("controllable", "yes" if result["controllable"] else "no"),
        ("least time, 1 m", _xyz(least["metre_s"], "s")),
        ("least time, 90°", _xyz(least["quarter_turn_s"], "s")),
    ]


def _xyz(values: list[Any], unit: str) -> str:
    """Three values, or three pairs of both ways; axes in which the robot does not move are left out."""
    known = [
        f"{axis} {_either_way(value) if isinstance(value, list) else f'{value:.4g}'}"
        for axis, value in zip("xyz", values, strict=True)
        if value is not None
    ]
    return f"{', '.join(known)} {unit}" if known else "none"


def _either_way(limits: list[float]) -> str:
    low, high = limits
    if low == high == 0.0:
        return "0"
    same = abs(low + high) <= 1e-6 * max(-low, high, 1e-12)
    return f"±{high:.4g}" if same else f"{low:.4g} to {high:.4g}"
