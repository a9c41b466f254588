"""`fulmar faults`: what goes wrong on robots, done to a live system."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from fulmar_bringup.console import console, output, print_json
from fulmar_bringup.progress import work_bar
from fulmar_cli.commands.arguments import JsonOption
from fulmar_core.errors import FAILED

if TYPE_CHECKING:
    from fulmar_evaluation.faults.fault_result import Finding
    from fulmar_evaluation.faults.suite import Skipped


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
    the safe state goes from the fault to the first applied state that is safe and stays so. Afterwards the bag is
    opened and compared with what a bystander heard. The exit code is 1 where one fails or cannot be done.

    Try:

    fulmar faults --robot turtlebot2 --only controller_killed,odometry_silent
    """
    from fulmar_cli.extras import require
    from fulmar_evaluation.faults.suite import faults_of, modules_for, run_faults

    chosen, skipped = faults_of(robot, names_in(only))
    require(*modules_for(robot, chosen))
    with work_bar("harming") as moved:
        findings = run_faults(robot, chosen, lambda done: moved(done, len(chosen)))
    if as_json:
        print_json(
            {
                "robot": robot,
                "faults": [asdict(finding) for finding in findings],
                "skipped": [asdict(fault) for fault in skipped],
            }
        )
    else:
        _print(robot, findings, skipped)
    if not all(finding.passed for finding in findings):
        raise typer.Exit(FAILED)


def names_in(only: str | None) -> list[str] | None:
    """Names between commas; None where nothing was said."""
    return None if only is None else [name.strip() for name in only.split(",") if name.strip()]


def _print(robot: str, findings: list[Finding], skipped: list[Skipped]) -> None:
    table = Table(title=f"faults of a live {robot}")
    for column in ("fault", "detected by", "reaction"):
        table.add_column(column)
    for column in ("safe after", "limit", "data lost", "bag", ""):
        table.add_column(column, justify="right")
    for finding in findings:
        table.add_row(
            finding.name,
            finding.detected_by or "nobody",
            finding.reaction,
            _time_to_safe(finding),
            "" if finding.limit_s is None else f"{finding.limit_s:.3f} s",
            "" if finding.data_lost is None else str(finding.data_lost),
            {True: "intact", False: "damaged", None: ""}[finding.bag_intact],
            finding.verdict,
        )
    output.print(table)
    for fault in skipped:
        console.print(f"skipped: {fault.name}: {fault.reason}", markup=False)


def _time_to_safe(finding: Finding) -> str:
    if finding.time_to_safe_s is not None:
        return f"{finding.time_to_safe_s:.3f} s"
    if finding.bag_intact is None:
        return ""
    return "goes on" if finding.limit_s is None else "never"
