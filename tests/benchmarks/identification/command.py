"""`fulmar benchmark identify`: estimates beside the truth, on simulated machines drawn at random."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from fulmar_bringup.console import console, output, print_json
from fulmar_bringup.progress import work_bar
from fulmar_cli.commands.arguments import JsonOption, RayOption, SeedOption
from fulmar_core.config.errors import FAILED, UnknownNameError

ROBOTS = ("floating_platform", "kingfisher", "turtlebot2", "jetbot")


def identify(
    platforms: Annotated[int, typer.Option(metavar="N", min=1, help="Machines of each robot.")] = 20,
    robots: Annotated[
        str, typer.Option(metavar="R,...", help=f"Out of {', '.join(ROBOTS)}; 'all' for every one.")
    ] = "floating_platform",
    seed: SeedOption = 1,
    duration: Annotated[
        float | None,
        typer.Option(metavar="S", min=10.0, help="Length of each run; the usual of its family by default."),
    ] = None,
    bags: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Keep the bags and truths here; they are thrown away by default."),
    ] = None,
    jobs: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Processes at once; one for each core.")
    ] = None,
    ray: RayOption = None,
    check: Annotated[
        bool, typer.Option("--check", help="End with code 1 unless everything asked was met.")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """Drive machines with random bodies, thrust, drag and delays in MuJoCo, and identify them from their bags.

    A platform drives twice, once with a ballast of known mass; sensors are as noisy as its YAML says, the floor slopes
    by up to a milliradian. Every run is written to a bag and read from it, as `fulmar identify` does.

    Try:

    fulmar benchmark identify --platforms 20 --seed 1

    fulmar benchmark identify --robots kingfisher,turtlebot2 --platforms 5
    """
    from fulmar_benchmarks.pool import on_cluster
    from fulmar_cli.installation.extras import require
    from tests.benchmarks.identification.campaign import Trial, document_of, run_identification

    require("mujoco", *(["ray"] if ray else []))
    names = ROBOTS if robots == "all" else tuple(dict.fromkeys(name.strip() for name in robots.split(",")))
    for name in names:
        if name not in ROBOTS:
            raise UnknownNameError("robot to identify", name, ROBOTS)
    trials = [Trial(name, number, seed, duration, bags) for name in names for number in range(platforms)]
    done = 0

    def state(result: dict[str, Any]) -> None:
        nonlocal done
        done += 1
        progress(done, len(trials))
        worst = ", ".join(
            f"{name} {'–' if q['error_percent'] is None else format(q['error_percent'], '.2f')} %"
            f"{'' if q['inside'] else ' (outside)'}"
            for name, q in result["quantities"].items()
        )
        console.print(f"{result['robot']} {result['number']}: {worst}", markup=False, soft_wrap=True)

    with on_cluster(ray), work_bar("driving") as progress:
        results = run_identification(trials, jobs=jobs or len(os.sched_getaffinity(0)), on_done=state)
    document = document_of(results, seed=seed)
    if as_json:
        print_json(document)
    else:
        _print(document)
    if check and document["met"] < document["asked"]:
        raise typer.Exit(FAILED)


def _print(document: dict[str, Any]) -> None:
    for robot, figures in document["figures"].items():
        table = Table(title=f"{robot}: errors of estimates")
        for column in ("", "machines", "mean", "worst", "worst", "95 % interval", "inside"):
            table.add_column(column, justify="left" if not column else "right")
        for name, f in figures.items():
            percent = [
                "–" if f[k] is None else f"{f[k]:.2f} %"
                for k in ("mean_error_percent", "worst_error_percent")
            ]
            unit = f["unit"]
            table.add_row(
                name,
                str(f["machines"]),
                *percent,
                f"{f['worst_error']:.3g} {unit}",
                f"± {f['mean_half_width']:.3g} {unit}",
                f"{f['coverage']:.2f}",
            )
        output.print(table)
    for line in document["required"]:
        output.print(
            f"{'met' if line['met'] else 'missed'}: {line['quantity']} within {line['worst_error_percent']:.2f} % "
            f"(at most {line['most_error_percent']:g} %), inside its interval {line['coverage']:.2f} "
            f"(at least {line['least_coverage']:g})",
            markup=False,
            soft_wrap=True,
        )
