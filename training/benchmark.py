"""Our faster PPO beside the one of Stable-Baselines3: speed, and success over time, on several seeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Any

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from training.executors import Executor, Watch
from training.jobs import Job, Outcome
from training.settings import Ppo, load_training_settings

KINDS = ("stock", "fast")


def benchmark_jobs(
    robot: str, task: str, *, seeds: Sequence[int], seconds: float, check_every_s: float, out: Path
) -> list[Job]:
    """One run of each kind for each seed; the two kinds of a seed follow one another, to run side by side.

    Args:
        robot: Name of the robot.
        task: Name of the task.
        seeds: Seeds of the runs.
        seconds: Wall-clock of each run [s].
        check_every_s: Wall-clock between checks on held-out episodes [s].
        out: Folder of the run folders.

    Raises:
        ConfigError: The settings of this robot and task are not for PPO.
    """
    settings = load_training_settings(load_robot(robot), load_task(task))
    algorithm = settings.algorithm
    if not isinstance(algorithm, Ppo):
        raise ConfigError(
            f"'{robot}' and '{task}' learn with {algorithm.kind}; this compares two kinds of ppo."
        )
    stock = replace(algorithm, fast=False, precision="float32")
    settings = replace(settings, evaluate_every_s=check_every_s, stop_at_success=None)
    return [
        Job(
            f"{kind} {seed}",
            robot,
            task,
            seed,
            replace(settings, algorithm=algorithm if kind == "fast" else stock),
            out / f"{kind}_{seed}",
            time_limit_s=seconds,
        )
        for seed in seeds
        for kind in KINDS
    ]


def compare(jobs: Sequence[Job], executor: Executor, watch: Watch) -> dict[str, Any]:
    """Run them and put what came out side by side.

    Args:
        jobs: Those of `benchmark_jobs`.
        executor: Runs them.
        watch: Receives their progress.

    Returns:
        For each kind: median speed [control steps/s], success at every check (median, lowest and highest over the
        seeds), and the median time to a success of 0.9 [s]; None where more than half never reached it.
    """
    outcomes = executor.run(jobs, watch)
    failed = [f"{outcome.job.name}: {outcome.error}" for outcome in outcomes if outcome.record is None]
    result: dict[str, Any] = {"robot": jobs[0].robot, "task": jobs[0].task, "failed": failed}
    times = _times(jobs[0])
    for kind in KINDS:
        records = [o.record for o in outcomes if o.record is not None and _kind(o) == kind]
        if records:
            result[kind] = _figures(records, times)
    if all(kind in result for kind in KINDS):
        result["speed_ratio"] = result["fast"]["steps_per_s"] / result["stock"]["steps_per_s"]
    return result


def _kind(outcome: Outcome) -> str:
    return outcome.job.name.split()[0]


def _times(job: Job) -> list[float]:
    """Times at which curves are compared [s]."""
    assert job.time_limit_s is not None
    every = job.settings.evaluate_every_s
    return [every * count for count in range(1, int(job.time_limit_s / every) + 1)]


def _figures(records: Sequence[dict[str, Any]], times: Sequence[float]) -> dict[str, Any]:
    curves = [[_success_at(record, time) for record in records] for time in times]
    arrivals = sorted(_time_to(record, 0.9) for record in records)
    arrival = median(arrivals)
    return {
        "seeds": [record["seed"] for record in records],
        "steps_per_s": median(record["steps_per_s"] for record in records),
        "time_to_0.9_s": None if arrival == float("inf") else arrival,
        "curve": [
            {"wall_s": time, "success": median(values), "lowest": min(values), "highest": max(values)}
            for time, values in zip(times, curves, strict=True)
        ],
    }


def _success_at(record: dict[str, Any], time: float) -> float:
    """Success at the last check before a time, with a second of grace; 0 before the first."""
    seen = [check["success_rate"] for check in record["curve"] if check["wall_s"] <= time + 1.0]
    return float(seen[-1]) if seen else 0.0


def _time_to(record: dict[str, Any], success: float) -> float:
    reached = (check["wall_s"] for check in record["curve"] if check["success_rate"] >= success)
    return float(next(reached, float("inf")))
