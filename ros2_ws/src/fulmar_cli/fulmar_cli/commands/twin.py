"""`fulmar twin`: from bags of a robot to a policy for it as it is."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from fulmar_bags.bag_reading import BagReading
from fulmar_bringup.console import log_line, print_result, warn, write_line
from fulmar_cli.commands.arguments import (
    JsonOption,
    PolicyOption,
    argument,
    flag,
    invoked_command,
    option,
)
from fulmar_cli.commands.bag_reading import BallastOption, KnownOption, with_bag_options
from fulmar_cli.installation.extras import require
from fulmar_core.config.errors import FAILED


@with_bag_options()
def twin(
    bags: Annotated[list[Path], argument("BAG...", "Driven runs of one robot.")],
    out: Annotated[Path, option("DIR", "Folder of the steps and the report; one that was begun goes on.")],
    policy: PolicyOption = None,
    known: KnownOption = None,
    ballast: BallastOption = None,
    retrain_below: Annotated[
        float, option("RATE", "Success of the old bundle under which a new one is trained.", min=0.0, max=1.0)
    ] = 0.9,
    updates: Annotated[
        int | None, option("N", "Updates of the training; those of the shipped policy by default.", min=1)
    ] = None,
    episodes: Annotated[int, option("N", "Episodes in MuJoCo of each bundle.", min=1)] = 256,
    accept: Annotated[bool, flag("--accept", "Write the new bundle to --bundle, if it is better.")] = False,
    bundle: Annotated[Path | None, option("DIR", "Folder of the accepted bundle; new or empty.")] = None,
    as_json: JsonOption = False,
    *,
    reading: BagReading,
) -> None:
    """Identify a robot from its bags, and train a new policy where the old one no longer does.

    Steps: identify; evaluate the old bundle in MuJoCo on the robot as identified; where it succeeds in less than
    --retrain-below, train by the recipe of the shipped policy; evaluate the new bundle; let both answer the bags;
    report. Each step is a file in --out. The same command again does only what is missing, or what was made from
    something else.

    Exit code: 0 the old bundle stays, or the new one is better; 1 it is not; 2 the bags or the bundle cannot be used.

    Try:

    fulmar run floating_platform --controller excite --duration 120 --record runs/driven

    fulmar twin runs/driven --known mass=6.92+-0.01 --out runs/twin

    fulmar twin runs/driven --known mass=6.92+-0.01 --out runs/twin --accept --bundle runs/bundles/mine
    """
    require(
        "mujoco",
        "onnxruntime",
        "mcap",
        "rosbags",
        "torch",
        "stable_baselines3",
        "sb3_contrib",
        "gymnasium",
        "onnx",
    )
    from fulmar_evaluation.twin.request import TwinRequest, check_target, chosen_bundle, robot_of
    from fulmar_evaluation.twin.twin import accept as write_accepted
    from fulmar_evaluation.twin.twin import run_twin

    check_target(bundle, accept=accept)
    robot, task = robot_of(bags, reading)
    chosen, task = chosen_bundle(robot, reading.task or task, policy)
    request = TwinRequest(
        tuple(bags), out, chosen, robot, task, tuple(known or ()), tuple(ballast or ()), reading, retrain_below,
        updates, episodes, bundle, invoked_command(),
    )  # fmt: skip
    report = run_twin(request, log_line)
    warn(report["warnings"])
    if not report["trusted"]:
        log_line(f"note: {report['scale']}.")
    accepted = str(bundle) if accept and write_accepted(request, report) else None
    print_result({**report, "accepted": accepted, "folder": str(out)}, _print, as_json=as_json)
    if report["new"] is not None and not report["better"]:
        raise typer.Exit(FAILED)


def _print(report: dict[str, Any]) -> None:
    for name, e in report["estimates"].items():
        nominal = "" if e["nominal"] is None else f"; YAML {e['nominal']:.5g}"
        write_line(f"{name:<24} {e['value']:.5g} ({e['low']:.5g} to {e['high']:.5g}) {e['unit']}{nominal}")
    write_line(report["result"])
    write_line(f"report: {report['folder']}/report.md")
    if report["accepted"]:
        write_line(f"accepted: {report['accepted']}; use it with --calibration {report['calibration']}")
