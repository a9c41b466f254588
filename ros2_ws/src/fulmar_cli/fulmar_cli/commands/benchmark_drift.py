"""`fulmar benchmark drift`: our controllers under DRIFT's disturbances, beside its own."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from fulmar_bringup.console import console, output, print_json
from fulmar_bringup.progress import work_bar
from fulmar_cli.commands.arguments import JsonOption, PolicyOption, SeedOption
from fulmar_core.episode import EVALUATION_SEED
from fulmar_core.errors import FAILED, UnknownNameError


def drift(
    through: Annotated[
        str,
        typer.Option(metavar="batch|mujoco|ros", help="ros: the deployed nodes over DDS, in lock step."),
    ] = "ros",
    controllers: Annotated[
        str, typer.Option(metavar="K,...", help="Out of policy and the classical controllers.")
    ] = "policy,lqr",
    rows: Annotated[
        str | None,
        typer.Option(metavar="R,...", help="Names of conditions and paths; all twelve by default."),
    ] = None,
    episodes: Annotated[
        int, typer.Option(metavar="N", min=1, help="Trajectories of each condition; paths have at most 4.")
    ] = 256,
    seed: SeedOption = EVALUATION_SEED,
    policy: PolicyOption = None,
    tracking_policy: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Policy bundle for the paths; the shipped one by default."),
    ] = None,
    out: Annotated[
        Path,
        typer.Option(
            "--out",
            "--output",
            metavar="DIR",
            help="Where outcomes are kept, and the report with its pictures.",
        ),
    ] = Path("runs/benchmark/drift"),
    jobs: Annotated[
        int | None,
        typer.Option(
            metavar="N", min=1, help="Processes at once, pairs of them through ros; one for each core."
        ),
    ] = None,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="Judge again what was judged before and did not change.")
    ] = False,
    report: Annotated[bool, typer.Option(help="Draw the report.")] = True,
    check: Annotated[
        bool, typer.Option("--check", help="End with code 1 unless everything asked was measured and met.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Run the experiment of thesis Tables 3.5 and 3.6, and print both side by side.

    Nine conditions of 256 trajectories from 3 to 4 m away, 250 steps of 0.2 s each, and three paths that are followed
    at 0.2 m/s; in MuJoCo, through the nodes that are deployed. What was judged before with the same code, configuration
    and controller is taken from DIR, so an interrupted benchmark goes on where it stopped. DIR/index.html is the
    report, DIR/drift.json the figures.

    Try:

    fulmar benchmark drift --rows ideal,torque --controllers lqr --through mujoco
    """
    from fulmar_benchmarks.drift.campaign import Request, run_drift
    from fulmar_benchmarks.drift.conditions import ROWS
    from fulmar_benchmarks.drift.tables import print_tables
    from fulmar_benchmarks.drift.unit import DriftUnit
    from fulmar_benchmarks.outcomes import Judged
    from fulmar_benchmarks.unit import Unit
    from fulmar_cli.commands.benchmark_roboran import chosen
    from fulmar_cli.extras import require
    from fulmar_evaluation.evaluation import WAYS
    from policy_server.controllers import CONTROLLERS

    if through not in WAYS:
        raise UnknownNameError("way", through, WAYS)
    known = tuple(name for name in CONTROLLERS if name != "classical")
    names = tuple(dict.fromkeys(name.strip() for name in controllers.split(",") if name.strip()))
    chosen(controllers, "controller", known)
    if "policy" in names:
        require("onnxruntime")
    if through != "batch":
        require("mujoco")
    if report:
        require("matplotlib")
    request = Request(
        rows=ROWS if rows is None else chosen(rows, "row", ROWS),
        controllers=known if "all" in names else names,
        through=through,
        episodes=episodes,
        seed=seed,
        folder=out,
        policy=policy,
        tracking_policy=tracking_policy,
        jobs=jobs or len(os.sched_getaffinity(0)),
        fresh=fresh,
        command="fulmar " + " ".join(sys.argv[1:]),
    )

    def tell(unit: Unit, outcome: Judged | str, before: bool) -> None:
        assert isinstance(unit, DriftUnit)
        name = f"{unit.row}, {unit.controller}"
        if isinstance(outcome, str):
            console.print(f"{name}: failed: {outcome}", markup=False, soft_wrap=True)
            return
        speed = outcome.about["control_steps"] / outcome.about["wall_s"]
        how = "judged before" if before else f"{outcome.about['wall_s']:.1f} s, {speed:,.0f} steps/s"
        console.print(f"{name}: {_main_figure(outcome)} ({how})", markup=False, soft_wrap=True)

    with work_bar("judging") as progress:
        findings = run_drift(request, progress=progress, on_done=tell)
    document = findings.document
    written = _write(findings, out, report)
    if as_json:
        print_json(document)
    else:
        print_tables(document, output)
    console.print(f"written: {written}", markup=False, soft_wrap=True)
    if check and document["met"] < document["asked"]:
        raise typer.Exit(FAILED)


def _main_figure(outcome: object) -> str:
    from fulmar_benchmarks.outcomes import Judged

    assert isinstance(outcome, Judged)
    figures = outcome.figures
    if "PT5_percent" in figures:
        return f"PT5 {figures['PT5_percent'].mean():.1f} %, OT5 {figures['OT5_percent'].mean():.1f} %"
    return f"velocity error {figures['velocity_error_m_s'].mean():.4f} m/s"


def _write(findings: object, out: Path, report: bool) -> Path:
    import json

    from fulmar_benchmarks.drift.campaign import Findings

    assert isinstance(findings, Findings)
    out.mkdir(parents=True, exist_ok=True)
    path = out / "drift.json"
    path.write_text(json.dumps(findings.document, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    if report:
        from fulmar_benchmarks.drift.report import write_report

        return write_report(findings, out)
    return path
