"""`fulmar run --system FLEET` and `fulmar up FLEET`: what both do where a system file has several robots."""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fulmar_bringup.console import log_line, print_result, write_line
from fulmar_cli.commands.arguments import argument, invoked_command
from fulmar_cli.commands.envelope import warn_outside
from fulmar_cli.commands.folders import dated_folder
from fulmar_core.config.errors import DONE, FAILED, ConfigError

OptionalRobot = Annotated[str | None, argument("[ROBOT]", "A name from `fulmar list robots`.")]
RECORDS = ("--record", "--record-each")
BOTH_TAKE = ("--rate", "--seed", *RECORDS, "--estop", "--require-envelope", "--json", "--console")
RUN_TAKES = (*BOTH_TAKE, "--system", "--lockstep", "--duration", "--no-keep-apart")
UP_TAKES = (*BOTH_TAKE, "--dry-run")

if TYPE_CHECKING:
    from fulmar_bringup.fleet_plan import FleetChoices, FleetPlan


def check_alone(what: str, allowed: Collection[str], words: Sequence[str]) -> None:
    """Refuse options of one robot beside a fleet, whose file has them for each.

    Args:
        what: Command and fleet, for the message.
        allowed: Options that a fleet takes.
        words: The command line.

    Raises:
        ConfigError: On the first other one that the command line has.
    """
    for word in words:
        option = word.partition("=")[0]
        if option.startswith("--") and option not in allowed:
            raise ConfigError(f"{what} takes no {option}: the fleet's file says it for each robot.")


def for_fleet(system: str | None, *, record_each: bool) -> bool:
    """Whether a system is a fleet.

    Raises:
        ConfigError: There is no such system, or `--record-each` is given and it is none.
    """
    from fulmar_bringup.fleet_file import is_fleet

    fleet = system is not None and is_fleet(system)
    if record_each and not fleet:
        raise ConfigError("--record-each is for fleets, and one robot has one bag. Leave it out.")
    return fleet


def robot_or_fleet(
    robot: str | None,
    fleet: str | None,
    choices: tuple[Any, ...],
    *,
    as_json: bool,
    require_envelope: bool,
) -> str:
    """The robot of `fulmar run`; where a fleet is asked for, that is run instead.

    Args:
        robot: Name of the robot.
        fleet: Name of the fleet.
        choices: The first fields of `FleetChoices`, for a fleet.
        as_json: How its result is printed.
        require_envelope: Whether every robot has to lie inside the certified set of its bundle.

    Raises:
        BundleError: A robot does not, and that is required.
        ConfigError: Neither or both are given, or an option of one robot beside a fleet.
        typer.Exit: The fleet has run: 0 every robot met its goal and none came too near to another, 1 otherwise.
    """
    if fleet is None and robot is None:
        raise ConfigError("say which robot: fulmar run ROBOT, from `fulmar list robots`; or --system FLEET.")
    if fleet is None:
        for_fleet(None, record_each=bool(choices[-1]))
        return str(robot)
    if robot is not None:
        raise ConfigError(f"give the robot '{robot}' or --system {fleet}, not both.")
    check_alone(f"--system {fleet}", RUN_TAKES, sys.argv[2:])
    from fulmar_bringup.fleet_plan import FleetChoices
    from fulmar_evaluation.fleet_outcome import fleet_text, run_fleet_and_evaluate

    plan = fleet_to_start(fleet, FleetChoices(*choices), require_envelope=require_envelope)
    outcome = run_fleet_and_evaluate(plan)
    print_result(outcome.summary, lambda summary: write_line(fleet_text(summary)), as_json=as_json)
    if outcome.failure:
        log_line(f"run failed: {outcome.failure}")
    raise typer.Exit(outcome.exit_code)


def keep_one_fleet_up(
    name: str, choices: tuple[Any, ...], report: Callable[..., None], *, dry_run: bool, require_envelope: bool
) -> None:
    """Keep a fleet running until Ctrl-C or SIGTERM; arguments as in `robot_or_fleet`.

    Raises:
        BundleError: As there.
        typer.Exit: 0 stopped, 1 the world or every robot was lost.
    """
    check_alone(f"fulmar up {name}", UP_TAKES, sys.argv[2:])
    from fulmar_bringup.fleet_executor import keep_fleet_up
    from fulmar_bringup.fleet_plan import FleetChoices

    asked = replace(FleetChoices(*choices), standing=True)
    plan = fleet_to_start(name, asked, require_envelope=require_envelope)
    if dry_run:
        return
    end = keep_fleet_up(plan, report)
    failure = "" if end.failure.startswith("stopped by") else end.failure
    bags = sorted({str(file.parent) for file in Path(plan.record).rglob("*.mcap")})
    report("stopped", failure=failure or None, bags=bags)
    raise typer.Exit(FAILED if failure else DONE)


def fleet_to_start(name: str, choices: FleetChoices, *, require_envelope: bool) -> FleetPlan:
    """The plan of a fleet whose nodes can run here; warns of robots outside the certified sets of their bundles.

    Raises:
        BundleError: There is one, and that is refused.
        ConfigError: As in `fleet_plan`, or a module is not installed.
    """
    from fulmar_bringup.fleet_plan import fleet_plan
    from fulmar_cli.installation.extras import check_plan

    record = choices.record or dated_folder("runs", name)
    plan = fleet_plan(name, replace(choices, record=record, command=invoked_command()))
    for one in plan.robots:
        check_plan(one)
        warn_outside(one, required=require_envelope)
        log_line(f"{one.robot_name}: {one.line}")
    return plan
