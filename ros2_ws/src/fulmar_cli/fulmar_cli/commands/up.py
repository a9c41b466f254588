"""`fulmar up`: a system that runs until it is stopped."""

from __future__ import annotations

import json
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from fulmar_bringup.console import console, output
from fulmar_bringup.progress import live_line
from fulmar_cli.commands.arguments import (
    ArmOption,
    NameOption,
    PolicyOption,
    ScenarioOption,
    SeedOption,
    read_pose,
)
from fulmar_core.errors import DONE, FAILED


def up(
    system: Annotated[
        str, typer.Argument(metavar="SYSTEM", help="A name from `fulmar list systems`.")
    ] = "mujoco_policy",
    robot: Annotated[str | None, typer.Option(metavar="R", help="Another robot than the system's.")] = None,
    name: NameOption = None,
    task: Annotated[str | None, typer.Option(metavar="T", help="Another task, or your own class.")] = None,
    controller: Annotated[
        str | None, typer.Option(metavar="C", help="Another controller, or your own class; or external.")
    ] = None,
    backend: Annotated[str | None, typer.Option(metavar="B", help="mujoco, mock or hardware.")] = None,
    hardware: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="With backend hardware: a name from configs/hardware, or a .yaml file."
        ),
    ] = None,
    emulate: Annotated[
        bool, typer.Option("--emulate", help="With backend hardware: an emulator speaks for the device.")
    ] = False,
    arm: ArmOption = False,
    policy: PolicyOption = None,
    scenario: ScenarioOption = "nominal",
    seed: SeedOption = 0,
    start: Annotated[
        str | None, typer.Option(metavar="x,y,deg", help="Where a simulated robot begins; 0,0,0 by default.")
    ] = None,
    rate: Annotated[
        float, typer.Option(metavar="F", min=0.01, max=50.0, help="Simulated seconds a second of wall-clock.")
    ] = 1.0,
    estop: Annotated[
        bool, typer.Option("--estop", help="Run an e-stop node; nothing moves without it.")
    ] = False,
    record: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder of the bag; runs/<time>... by default.")
    ] = None,
    recording: Annotated[
        str | None,
        typer.Option(
            metavar="whole|ring|goals",
            help="whole: one bag. goals: one bag for each goal, DIR/goal_001 and so on. ring: only what was around a "
            "fault. The system file's by default.",
        ),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object a line for each event, and nothing else.")
    ] = False,
) -> None:
    """Keep a system running until Ctrl-C or SIGTERM, and record it.

    Starts a plant, a controller and a recorder, and waits for goals: from `fulmar goals`, or from any ROS node that
    publishes one. Goals follow one another; `fulmar swap` changes the policy; `fulmar estop` stops the robot until its
    reset, after which it waits for a new goal. The end is orderly: actuators go to their safe state first, the bag is
    closed last. Exit code: 0 stopped, 1 a node failed or ended.

    Events of --json: started, goal, goal_refused, target, reached, swapped, swap_refused, estop, reset, fault,
    recovered, stopping, stopped; each has `event`, `wall_s` (Unix time) and what belongs to it.

    Try:

    fulmar up mujoco_lqr

    and, in another terminal:

    fulmar goals --robot floating_platform --pose 1,-0.5,90

    fulmar estop

    fulmar estop --reset
    """
    from fulmar_bringup.standing_system import keep_up, plan_system
    from fulmar_bringup.system import gains_note, modules_of, varied_system
    from fulmar_cli.commands.run import default_record
    from fulmar_cli.extras import require

    chosen = varied_system(
        system,
        robot=robot,
        robot_name=name,
        task=task,
        controller=controller,
        backend=backend,
        hardware=hardware,
    )
    if estop:
        chosen = replace(chosen, guards=replace(chosen.guards, estop=True))
    request = plan_system(
        chosen,
        record=record or default_record(chosen.name or chosen.robot, chosen.controller),
        command="fulmar " + " ".join(sys.argv[1:]),
        policy=policy,
        hardware=hardware,
        emulate=emulate,
        arm=arm,
        scenario=scenario,
        seed=seed,
        start=read_pose(start, "--start"),
        rate=rate,
        recording=recording,
    )
    plan = request.plan
    if note := gains_note(plan.robot, plan.controller):
        console.print(f"info: {note}", markup=False, soft_wrap=True)
    require(
        *modules_of(
            plan.controller, plan.backend, guards=plan.guards, hardware=plan.hardware, emulated=emulate
        )
    )
    report = _print_json if as_json else _print_words
    with live_line() as show:
        end = keep_up(request, report, show)
    report(
        "stopped",
        failure=end.failure or None,
        watchdog_trips=end.watchdog_trips,
        bags=[str(bag) for bag in _bags(request.record)],
    )
    raise typer.Exit(FAILED if end.failure else DONE)


def _bags(record: Path) -> list[Path]:
    """The bag of a system, or those of its goals."""
    return sorted({file.parent for file in record.rglob("*.mcap")})


def _print_json(event: str, **fields: Any) -> None:
    sys.stdout.write(json.dumps({"event": event, "wall_s": round(time.time(), 3), **fields}) + "\n")
    sys.stdout.flush()


def _print_words(event: str, **fields: Any) -> None:
    at = f"{fields.pop('time_s'):8.1f} s  " if "time_s" in fields else " " * 12
    words = ", ".join(f"{name} {value}" for name, value in fields.items() if value not in (None, "", []))
    output.print(
        f"{at}{event.replace('_', ' ')}" + (f": {words}" if words else ""), markup=False, soft_wrap=True
    )
