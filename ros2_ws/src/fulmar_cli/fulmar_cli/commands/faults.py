"""`fulmar faults`: faults injected into a live system."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from fulmar_bringup.console import output, print_json
from fulmar_bringup.progress import work_bar
from fulmar_cli.commands.arguments import JsonOption, option
from fulmar_cli.commands.fleet_faults import fleet_faults
from fulmar_core.config.errors import FAILED

if TYPE_CHECKING:
    from fulmar_evaluation.faults.fault import FaultResult
    from fulmar_evaluation.faults.suite import Skipped


ROBOT_HELP = (
    "A name from `fulmar list robots`, floating_platform by default; with --system the name of a robot of the fleet, "
    "its first by default."
)


def faults(
    robot: Annotated[str | None, option("R", ROBOT_HELP)] = None,
    system: Annotated[
        str | None, option("FLEET", "A fleet from `fulmar list systems`: one of its robots has the faults.")
    ] = None,
    only: Annotated[
        str | None, option("F,...", "Names of faults, with commas between; all by default.")
    ] = None,
    launcher: Annotated[
        str | None,
        option("L", "What starts the systems: run, up or both; by default both where they differ, else run."),
    ] = None,
    times: Annotated[int, option("N", "How often each fault is done.", min=1)] = 1,
    height: Annotated[float | None, option("M", "Height at which an aircraft begins [m].", min=0.0)] = None,
    as_json: JsonOption = False,
) -> None:
    """Inject faults into the parts of a live system, and measure how long it takes to be safe.

    Each fault has a system of its own, as `fulmar run` or `fulmar up` starts it, which runs in real time in MuJoCo
    with the shipped policy. The time to the safe state goes from the fault to the first applied state that is safe
    and stays so. Afterwards the bag is opened and compared with what an observer received. The exit code is 1 if a
    fault fails or cannot be injected. Faults that do not apply to the robot or to this computer are listed with the
    reason. With --system, each fault is done to a run of a fleet, and the other robots have to arrive.

    Try:

    fulmar faults --robot turtlebot2 --only controller_killed,odometry_silent

    fulmar faults --system fleet --robot beta --only controller_killed,fleet_estop
    """
    from fulmar_cli.installation.extras import require
    from fulmar_evaluation.faults.suite import at_height, faults_of, modules_for, run_faults, times_of

    if system is not None:
        _report(*fleet_faults(system, robot or "", names_in(only), times), as_json=as_json)
        return
    robot = robot or "floating_platform"
    chosen, skipped = faults_of(robot, names_in(only))
    chosen = chosen if height is None else at_height(chosen, robot, height)
    count = len(times_of(chosen, launcher, times))
    require(*modules_for(robot, chosen))
    with work_bar("injecting") as moved:
        results = run_faults(robot, chosen, lambda done: moved(done, count), launcher, times)
    _report({"robot": robot}, results, skipped, as_json=as_json)


def _report(
    about: dict[str, str], results: Sequence[FaultResult], skipped: list[Skipped], *, as_json: bool
) -> None:
    """Print what came of the faults.

    Raises:
        typer.Exit: One failed.
    """
    if as_json:
        found = {"faults": [asdict(one) for one in results], "skipped": [asdict(one) for one in skipped]}
        print_json(about | found)
    else:
        _print(" of ".join(reversed(about.values())), results, skipped)
    if not all(result.passed for result in results):
        raise typer.Exit(FAILED)


def names_in(only: str | None) -> list[str] | None:
    """Names between commas; None stands for all."""
    return None if only is None else [name.strip() for name in only.split(",") if name.strip()]


def _print(robot: str, results: Sequence[FaultResult], skipped: list[Skipped]) -> None:
    table = Table(title=f"faults of a live {robot}")
    for column in ("fault", "by", "detected by", "reaction"):
        table.add_column(column)
    for column in ("safe after", "limit", "data lost", "bag", ""):
        table.add_column(column, justify="right")
    for result in results:
        table.add_row(
            result.name,
            result.launcher,
            result.detected_by or "nobody",
            "; ".join(text for text in (result.reaction, _ended(result)) if text),
            _time_to_safe(result),
            "" if result.limit_s is None else f"{result.limit_s:.3f} s",
            "" if result.data_lost is None else str(result.data_lost),
            {True: "intact", False: "damaged", None: ""}[result.bag_intact],
            result.status,
        )
    output.print(table)
    if skipped:
        left_out = Table("fault", "why", title=f"faults that do not apply to {robot} here")
        for fault in skipped:
            left_out.add_row(fault.name, fault.reason)
        output.print(left_out)


def _ended(result: FaultResult) -> str:
    return f"`{result.launcher}` ends" if result.launcher_ended else ""


def _time_to_safe(result: FaultResult) -> str:
    if result.time_to_safe_s is not None:
        return f"{result.time_to_safe_s:.3f} s"
    if result.bag_intact is None:
        return ""
    return "goes on" if result.limit_s is None else "never"
