"""`fulmar benchmark training`: our faster PPO beside the one of Stable-Baselines3."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer

from fulmar_bringup.console import output, print_json
from fulmar_cli.commands.arguments import JsonOption
from fulmar_core.errors import FAILED


def training(
    robot: Annotated[str, typer.Argument(metavar="[ROBOT]")] = "floating_platform",
    task: Annotated[str, typer.Argument(metavar="[TASK]")] = "go_to_pose",
    seeds: Annotated[int, typer.Option(metavar="N", min=1, help="Seeds 1 to N.")] = 5,
    seconds: Annotated[float, typer.Option(metavar="S", min=1.0, help="Wall-clock of each run.")] = 40.0,
    check_every: Annotated[
        float, typer.Option(metavar="S", min=0.5, help="Wall-clock between checks on held-out episodes.")
    ] = 4.0,
    at_once: Annotated[int, typer.Option(metavar="N", min=1, help="Runs side by side.")] = 2,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder of the run folders.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Train with both, the same seeds side by side; print speed, and success over time.

    Success is the mean of the training scenario and the nominal one, on episodes that nobody learns from.
    """
    from training.benchmark import benchmark_jobs, compare
    from training.executors import LocalExecutor
    from training.job_bars import JobBars

    out = out or Path("runs") / "benchmark" / f"{time.strftime('%Y%m%d_%H%M%S')}_training"
    numbers = range(1, seeds + 1)
    jobs = benchmark_jobs(robot, task, seeds=numbers, seconds=seconds, check_every_s=check_every, out=out)
    with JobBars(jobs) as bars:
        told = compare(jobs, LocalExecutor(at_once), bars)
    if as_json:
        print_json(told)
    else:
        _print_comparison(told)
    if told["failed"]:
        raise typer.Exit(FAILED)


def _print_comparison(told: dict[str, Any]) -> None:
    for failure in told["failed"]:
        output.print(f"failed: {failure}", markup=False)
    kinds = [kind for kind in ("stock", "fast") if kind in told]
    output.print(f"{told['robot']} · {told['task']}: success as lowest – median – highest", soft_wrap=True)
    output.print(f"{'':<14}" + "".join(f"{kind:^26}" for kind in kinds))
    output.print(f"{'steps/s':<14}" + "".join(f"{told[kind]['steps_per_s']:^26,.0f}" for kind in kinds))
    arrivals = [told[kind]["time_to_0.9_s"] for kind in kinds]
    cells = ["never" if value is None else f"{value:.0f} s" for value in arrivals]
    output.print(f"{'success 0.9':<14}" + "".join(f"{cell:^26}" for cell in cells))
    for rows in zip(*(told[kind]["curve"] for kind in kinds), strict=True):
        cells = [f"{row['lowest']:.3f} – {row['success']:.3f} – {row['highest']:.3f}" for row in rows]
        output.print(f"{rows[0]['wall_s']:>8.0f} s    " + "".join(f"{cell:^26}" for cell in cells))
    if "speed_ratio" in told:
        output.print(f"fast is {told['speed_ratio']:.1f} times as fast as stock")
