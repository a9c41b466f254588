"""`fulmar benchmark roboran`: our table beside the thesis'."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from fulmar_bringup.console import console, output, print_json
from fulmar_bringup.progress import work_bar
from fulmar_cli.commands.arguments import JsonOption, ScenarioOption, SeedOption
from fulmar_core.episode import EVALUATION_SEED
from fulmar_core.errors import FAILED, UnknownNameError

ALL = "all"


def roboran(
    robots: Annotated[
        str | None,
        typer.Option(
            metavar="R,...", help="Names with commas between, or all; the thesis' three by default."
        ),
    ] = None,
    tasks: Annotated[
        str | None,
        typer.Option(metavar="T,...", help="Names with commas between, or all; five by default."),
    ] = None,
    through: Annotated[
        str, typer.Option(metavar="W,...", help="Out of batch, mujoco and ros, or all.")
    ] = "batch,mujoco",
    controllers: Annotated[
        str,
        typer.Option(
            metavar="K,...",
            help="policy: the shipped bundles. classical: the laws of the families.",
        ),
    ] = "policy",
    policies: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder of bundles named ROBOT_TASK; the shipped ones by default."),
    ] = None,
    episodes: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, help="In every way; 4,096, 256 and 16 through ros by default."),
    ] = None,
    seed: SeedOption = EVALUATION_SEED,
    scenario: ScenarioOption = "nominal",
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Where outcomes are kept, and the report with its pictures.")
    ] = Path("runs/benchmark/roboran"),
    jobs: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Processes at once; one for each core.")
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
    """Judge the shipped policies as thesis Table 4.7 does, and print both side by side.

    Success is judged on true states over the closing window, in 4,096 episodes of the core's batch and 256 in
    MuJoCo. What was judged before with the same code, configuration and controller is taken from DIR, so an
    interrupted benchmark goes on where it stopped. DIR/index.html is the report, DIR/roboran.json the figures.

    Try:

    fulmar benchmark roboran --robots turtlebot2 --tasks go_to_pose --controllers policy,classical
    """
    from fulmar_benchmarks.cells import spoken
    from fulmar_benchmarks.outcomes import Judged
    from fulmar_benchmarks.pairs import KINDS
    from fulmar_benchmarks.roboran.campaign import EPISODES, Request, run_benchmark
    from fulmar_benchmarks.roboran.published import ROBOTS, TASKS
    from fulmar_benchmarks.roboran.tables import print_tables
    from fulmar_benchmarks.unit import Unit
    from fulmar_cli.extras import require
    from fulmar_core.disturbances.scenario import load_scenario
    from fulmar_core.paths import config_names
    from policy_server.controllers import controller_entry

    load_scenario(scenario)
    ways = chosen(through, "way", tuple(EPISODES))
    kinds = chosen(controllers, "kind of controller", KINDS)
    for kind in kinds:
        require(*controller_entry(kind).needs)
    if "mujoco" in ways or "ros" in ways:
        require("mujoco")
    if report:
        require("matplotlib")
    request = Request(
        robots=ROBOTS if robots is None else chosen(robots, "robot", tuple(config_names("robots"))),
        tasks=TASKS if tasks is None else chosen(tasks, "task", tuple(config_names("tasks"))),
        kinds=kinds,
        episodes={way: episodes or EPISODES[way] for way in ways},
        seed=seed,
        scenario=scenario,
        folder=out,
        policies=policies,
        jobs=jobs or len(os.sched_getaffinity(0)),
        fresh=fresh,
        command="fulmar " + " ".join(sys.argv[1:]),
    )

    def tell(unit: Unit, outcome: Judged | str, before: bool) -> None:
        plan = unit.trial.plan
        name = f"{spoken(plan.robot)}, {spoken(plan.task).lower()}, {plan.controller}, {unit.trial.through}"
        if isinstance(outcome, str):
            console.print(f"{name}: failed: {outcome}", markup=False, soft_wrap=True)
        else:
            how = "judged before" if before else f"{outcome.about['wall_s']:.1f} s"
            console.print(
                f"{name}: success {outcome.succeeded.mean():.3f} ({how})", markup=False, soft_wrap=True
            )

    with work_bar("judging") as progress:
        findings = run_benchmark(request, progress=progress, on_done=tell)
    document = findings.document
    written = _write(findings, out, report)
    if as_json:
        print_json(document)
    else:
        print_tables(document, output)
    console.print(f"written: {written}", markup=False, soft_wrap=True)
    if check and document["met"] < document["asked"]:
        raise typer.Exit(FAILED)


def chosen(text: str, family: str, known: tuple[str, ...]) -> tuple[str, ...]:
    """Names with commas between them, in the order of those known; "all" for each of them.

    Raises:
        UnknownNameError: For the first that is not known.
    """
    names = {name.strip() for name in text.split(",") if name.strip()}
    for name in sorted(names - {ALL}):
        if name not in known:
            raise UnknownNameError(family, name, known)
    return known if ALL in names else tuple(name for name in known if name in names)


def _write(findings: object, out: Path, report: bool) -> Path:
    import json

    from fulmar_benchmarks.roboran.campaign import Findings

    assert isinstance(findings, Findings)
    out.mkdir(parents=True, exist_ok=True)
    path = out / "roboran.json"
    path.write_text(json.dumps(findings.document, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    if report:
        from fulmar_benchmarks.roboran.report import write_report

        return write_report(findings, out)
    return path
