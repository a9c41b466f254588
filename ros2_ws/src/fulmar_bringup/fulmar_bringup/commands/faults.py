"""`fulmar faults`: what goes wrong on robots, done to a live system."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from fulmar_bringup.commands.arguments import JsonOption
from fulmar_bringup.console import console, output, print_json
from fulmar_bringup.progress import work_bar
from fulmar_core.exit_codes import FAILED

if TYPE_CHECKING:
    from fulmar_bringup.faults.finding import Finding


def faults(
    robot: Annotated[
        str, typer.Option(metavar="R", help="A name from `fulmar list robots`.")
    ] = "floating_platform",
    only: Annotated[
        str | None,
        typer.Option(metavar="F,...", help="Some faults by name, with commas between; all by default."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Kill, stop, spoil and deceive the parts of a live system, and measure how long it takes to be safe.

    Each fault is done to a system of its own, which runs in real time in MuJoCo with the shipped policy. The time to
    the safe state goes from the fault to the first applied state that is safe and stays so. The exit code is 1 where
    one fails.

    Try:

    fulmar faults --robot turtlebot2 --only controller_killed,odometry_silent
    """
    from fulmar_bringup.extras import require
    from fulmar_bringup.faults.suite import faults_of, run_faults, skipped_here
    from fulmar_bringup.faults.two_hosts import why_not
    from fulmar_bringup.system import modules_of

    chosen = faults_of(robot, [name.strip() for name in only.split(",")] if only else None)
    require(*modules_of("policy", "mujoco"))
    if skipped_here() and not only:
        names = ", ".join(fault.__name__ for fault in skipped_here())
        console.print(f"skipped: {names}: {why_not()}", markup=False)
    with work_bar("harming") as moved:
        findings = run_faults(robot, chosen, lambda done: moved(done, len(chosen)))
    if as_json:
        print_json({"robot": robot, "faults": [asdict(finding) for finding in findings]})
    else:
        _print(robot, findings)
    if not all(finding.passed for finding in findings):
        raise typer.Exit(FAILED)


def _print(robot: str, findings: list[Finding]) -> None:
    table = Table(title=f"faults of a live {robot}")
    for column in ("fault", "detected by", "reaction"):
        table.add_column(column)
    for column in ("safe after", "limit", ""):
        table.add_column(column, justify="right")
    for finding in findings:
        time_s, limit_s = finding.time_to_safe_s, finding.limit_s
        table.add_row(
            finding.name,
            finding.detected_by or "nobody",
            finding.reaction,
            "goes on"
            if time_s is None and limit_s is None
            else "never"
            if time_s is None
            else f"{time_s:.3f} s",
            "" if limit_s is None else f"{limit_s:.3f} s",
            "passed" if finding.passed else "FAILED",
        )
    output.print(table)
