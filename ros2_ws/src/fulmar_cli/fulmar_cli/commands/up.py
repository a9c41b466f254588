"""`fulmar up`: a system that runs until it is stopped."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from fulmar_bringup.console import log_line, print_json, write_line
from fulmar_bringup.progress import live_line
from fulmar_cli.commands import arguments as cli
from fulmar_cli.commands.arguments import argument, flag, option
from fulmar_cli.commands.console_options import with_console
from fulmar_cli.commands.envelope import RequireEnvelopeOption, warn_outside
from fulmar_cli.commands.fleet import for_fleet, keep_one_fleet_up
from fulmar_cli.commands.folders import recorded
from fulmar_cli.commands.origin import OriginOption, read_origin
from fulmar_cli.commands.values import read_pose
from fulmar_core.config.errors import DONE, FAILED

SYSTEM_HELP = (
    "A name from `fulmar list systems`; mujoco_policy by default, or what the robot of --robot usually does."
)
START_HELP = (
    "Where a simulated robot begins, in space x,y,z[,roll,pitch,yaw], of satellites roll,pitch,yaw; by default the "
    "origin."
)
SERVICE_HELP = (
    "For a start without a person: the e-stop is pressed until `fulmar estop --reset`, and nothing is armed."
)
RECORDING_HELP = (
    "whole: one bag. goals: one bag for each goal, DIR/goal_001 and so on. ring: only the time around a fault. "
    "The system file's by default."
)
ONLY_HELP = (
    "Start this part alone; the other one runs in another container or on another host. plant: with guards and "
    "recorder. See docs/systems.md."
)


@with_console
@cli.with_node_options(standing=True)
def up(
    system: Annotated[str | None, argument("[SYSTEM]", SYSTEM_HELP)] = None,
    robot: Annotated[
        str | None, option("R", "Another robot than the system's, or one without a system.")
    ] = None,
    name: cli.NameOption = None,
    task: Annotated[str | None, option("T", "Another task, or your own class.")] = None,
    controller: Annotated[
        str | None, option("C", "Another controller, or your own class; or external.")
    ] = None,
    backend: Annotated[str | None, option("B", "mujoco, mock, jsbsim, basilisk or hardware.")] = None,
    hardware: cli.HardwareOption = None,
    emulate: cli.EmulateOption = False,
    arm: cli.ArmOption = False,
    policy: cli.PolicyOption = None,
    scenario: cli.ScenarioOption = "nominal",
    seed: cli.SeedOption = 0,
    start: Annotated[str | None, option("x,y,deg", START_HELP)] = None,
    origin: OriginOption = None,
    rate: cli.RateOption = 1.0,
    estop: cli.EstopOption = False,
    record: cli.RecordOption = None,
    recording: Annotated[str | None, option("whole|ring|goals", RECORDING_HELP)] = None,
    record_each: cli.RecordEachOption = False,
    require_envelope: RequireEnvelopeOption = False,
    service: Annotated[bool, flag("--service", SERVICE_HELP)] = False,
    only: Annotated[str | None, option("plant|controller", ONLY_HELP)] = None,
    dry_run: Annotated[bool, flag("--dry-run", "Check all, say what would start, start nothing.")] = False,
    as_json: Annotated[
        bool, cli.json_flag("Print one JSON object a line for each event, and nothing else.")
    ] = False,
    extras: tuple[str, ...] = (),
) -> None:
    """Keep a system running until Ctrl-C or SIGTERM, and record it.

    Starts a plant, a controller and a recorder, and waits for goals: from `fulmar goals`, or from any ROS node that
    publishes one. Goals follow one another; `fulmar swap` changes the controller; `fulmar estop` stops the robot until
    its reset, after which it waits for a new goal. The shutdown is orderly: actuators go to their safe state first, the
    bag is closed last. An aircraft lands first; a second Ctrl-C ends it at once. Recorder, markers and the e-stop node
    are started again when they end. Exit code: 0 stopped, 1 a node failed or ended that the robot cannot do without.

    Events of --json: console, started, goal, goal_refused, target, reached, swapped, swap_refused, estop, reset, fault,
    recovered, restarted, stopping, stopped; each has `event`, `wall_s` (Unix time) and its own fields.

    Try:

    fulmar up mujoco_lqr

    and, in another terminal:

    fulmar goals --robot floating_platform --pose 1,-0.5,90

    fulmar estop

    fulmar estop --reset

    fulmar up --robot spacecraft_16          # any robot of `fulmar list robots`, as `fulmar run` would

    fulmar up mujoco_lqr --only plant        # and on another host: fulmar up mujoco_lqr --only controller
    """
    from fulmar_bringup.completion import completed
    from fulmar_bringup.node_spec import CONTROLLER
    from fulmar_bringup.plan_checks import checked
    from fulmar_bringup.split_controller import keep_controller_up
    from fulmar_bringup.standing_system import keep_up
    from fulmar_bringup.system_plan import system_plan
    from fulmar_cli.installation.extras import check_plan

    report = _print_json if as_json else _print_words
    if for_fleet(system, record_each=record_each) and system is not None:
        asked_of_all = seed, False, rate, None, record, estop, True, record_each
        keep_one_fleet_up(system, asked_of_all, report, dry_run=dry_run, require_envelope=require_envelope)
        return
    asked = system_plan(system, robot=robot, name=name, task=task, controller=controller, backend=backend)
    plan = replace(
        asked, policy=str(policy or ""), hardware=hardware or "", emulated=emulate, arm=arm, scenario=scenario,
        seed=seed, start=read_pose(start, "--start", asked.robot) or (), rate=rate, recording_mode=recording or "",
        origin=read_origin(origin) or asked.origin,
        extras=tuple(dict.fromkeys((*asked.extras, *extras))), unattended=service, only=only or "",
        guards=replace(asked.guards, estop=estop or asked.guards.estop), record=str(record or ""),
        command=cli.invoked_command(),
    )  # fmt: skip
    plan = checked(recorded(completed(plan)))
    check_plan(plan)
    warn_outside(plan, required=require_envelope)
    log_line(plan.line)
    if dry_run:
        return
    with live_line() as show:
        end = (keep_controller_up if only == CONTROLLER else keep_up)(plan, report, show)
    # One, or one for each goal.
    bags = sorted({str(file.parent) for file in Path(plan.record).rglob("*.mcap")})
    report("stopped", failure=end.failure or None, watchdog_trips=end.watchdog_trips, bags=bags)
    raise typer.Exit(FAILED if end.failure else DONE)


def _print_json(event: str, **fields: Any) -> None:
    print_json({"event": event, "wall_s": round(time.time(), 3), **fields}, indent=None)


def _print_words(event: str, **fields: Any) -> None:
    at = f"{fields.pop('time_s'):8.1f} s  " if "time_s" in fields else " " * 12
    words = ", ".join(f"{name} {value}" for name, value in fields.items() if value not in (None, "", []))
    write_line(f"{at}{event.replace('_', ' ')}" + (f": {words}" if words else ""))
