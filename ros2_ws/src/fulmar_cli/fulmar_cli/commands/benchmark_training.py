"""`fulmar benchmark training`: our faster PPO beside the one of Stable-Baselines3."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from fulmar_bringup.console import print_result, write_line
from fulmar_cli.commands.arguments import JsonOption, option
from fulmar_cli.commands.folders import dated_folder
from fulmar_core.config.errors import FAILED


def training(
    robot: Annotated[str, typer.Argument(metavar="[ROBOT]")] = "floating_platform",
    task: Annotated[str, typer.Argument(metavar="[TASK]")] = "go_to_pose",
    seeds: Annotated[int, option("N", "Seeds 1 to N.", min=1)] = 5,
    seconds: Annotated[float, option("S", "Wall-clock of each run.", min=1.0)] = 40.0,
    check_every: Annotated[
        float, option("S", "Wall-clock between checks on held-out episodes.", min=0.5)
    ] = 4.0,
    at_once: Annotated[int, option("N", "Runs side by side.", min=1)] = 2,
    out: Annotated[Path | None, option("DIR", "Folder of the run folders.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Train with both, the same seeds side by side; print speed, and success over time.

    Success is the mean of the training scenario and the nominal one, on episodes that nobody learns from.
    """
    from fulmar_core.simulation.counts import PROCESS_BYTES, check_count
    from training.benchmark import benchmark_jobs, compare
    from training.executors import LocalExecutor
    from training.progress import JobBars

    check_count("--seeds", seeds)
    check_count("--at-once", at_once, bytes_each=PROCESS_BYTES)
    out = out or dated_folder("runs/benchmark", "training")
    numbers = range(1, seeds + 1)
    jobs = benchmark_jobs(robot, task, seeds=numbers, seconds=seconds, check_every_s=check_every, out=out)
    with JobBars([job.name for job in jobs]) as bars:
        result = compare(jobs, LocalExecutor(at_once), bars)
    print_result(result, _print_comparison, as_json=as_json)
    if result["failed"]:
        raise typer.Exit(FAILED)


def _print_comparison(result: dict[str, Any]) -> None:
    for failure in result["failed"]:
        write_line(f"failed: {failure}")
    kinds = [kind for kind in ("stock", "fast") if kind in result]
    write_line(f"{result['robot']} · {result['task']}: success as lowest – median – highest")
    write_line(f"{'':<14}" + "".join(f"{kind:^26}" for kind in kinds))
    write_line(f"{'steps/s':<14}" + "".join(f"{result[kind]['steps_per_s']:^26,.0f}" for kind in kinds))
    arrivals = [result[kind]["time_to_0.9_s"] for kind in kinds]
    cells = ["never" if value is None else f"{value:.0f} s" for value in arrivals]
    write_line(f"{'success 0.9':<14}" + "".join(f"{cell:^26}" for cell in cells))
    for rows in zip(*(result[kind]["curve"] for kind in kinds), strict=True):
        cells = [f"{row['lowest']:.3f} – {row['success']:.3f} – {row['highest']:.3f}" for row in rows]
        write_line(f"{rows[0]['wall_s']:>8.0f} s    " + "".join(f"{cell:^26}" for cell in cells))
    if "speed_ratio" in result:
        write_line(f"fast is {result['speed_ratio']:.1f} times as fast as stock")
