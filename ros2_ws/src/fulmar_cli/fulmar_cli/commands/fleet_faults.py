"""`fulmar faults --system FLEET`: faults injected into one robot of a live fleet."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from fulmar_bringup.progress import work_bar
from fulmar_cli.commands.fleet import check_alone

if TYPE_CHECKING:
    from fulmar_evaluation.faults.fleet_suite import FleetFaultResult
    from fulmar_evaluation.faults.suite import Skipped

TAKES = ("--system", "--robot", "--only", "--times", "--json")


def fleet_faults(
    fleet: str, robot: str, names: list[str] | None, times: int
) -> tuple[dict[str, str], list[FleetFaultResult], list[Skipped]]:
    """Do faults to a robot of a fleet.

    Args:
        fleet: Name of its file.
        robot: Name of the robot; empty: the first.
        names: Of the faults; None: all that the robot can have.
        times: How often each is done.

    Returns:
        Fleet and robot by name, a result for each fault, and the faults that are left out.

    Raises:
        ConfigError: Unknown fleet, robot or fault, or an option that a fleet does not take.
    """
    from fulmar_bringup.fleet_plan import FleetChoices, fleet_plan
    from fulmar_cli.installation.extras import check_plan
    from fulmar_evaluation.faults.fleet_environment import row_of
    from fulmar_evaluation.faults.fleet_suite import faults_of_fleet, run_fleet_faults

    check_alone(f"--system {fleet}", TAKES, sys.argv[2:])
    name = row_of(fleet, robot).called
    chosen, skipped = faults_of_fleet(fleet, name, names)
    for one in fleet_plan(fleet, FleetChoices()).robots:
        check_plan(one)
    count = len(chosen) * times
    with work_bar("injecting") as moved:
        results = run_fleet_faults(fleet, name, chosen, lambda done: moved(done, count), times)
    return {"fleet": fleet, "robot": name}, results, skipped
