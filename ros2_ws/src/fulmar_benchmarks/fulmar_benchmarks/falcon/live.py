"""The same flights in the core's batch, through ROS nodes in lock step, and through nodes in real time."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fulmar_bags.run_record import read_run
from fulmar_bringup.completion import completed
from fulmar_bringup.domains import own_domain
from fulmar_bringup.plan_checks import checked
from fulmar_bringup.run_executor import execute
from fulmar_core.config.errors import RunFailed
from fulmar_core.simulation.flight_figures import flight_figures as figures
from fulmar_core.simulation.metrics import join
from fulmar_evaluation.evaluation import Trial, runs_of
from fulmar_evaluation.run_evaluation import evaluate_run
from fulmar_evaluation.run_summary import summarise

Progress = Callable[[float, float], None]
ALTITUDE = "altitude_rmse_m"
APART_M = 0.02  # figures through nodes may differ so much from those of the batch
PERIOD_MS = 3.0  # limit of the 99th percentile of the control period's error, in real time
SHOWN = (ALTITUDE, "late_altitude_rmse_m", "rmse_per_axis_m", "peak_error_m", "survival")


@dataclass(frozen=True)
class LiveRequest:
    """What to fly."""

    trial: Trial  # through ros: the flights in lock step
    real_time: int  # flights by the clock


def fly_live(request: LiveRequest, progress: Progress) -> dict[str, Any]:
    """Fly everything; figures by way, ready for JSON.

    Raises:
        RunFailed: A controller ended, or refused to start.
        LockstepError: One did not answer in time.
    """
    trial, plan = request.trial, request.trial.plan
    steps = trial.episodes * round(plan.duration_s * plan.control_hz)
    clocked = request.real_time * round(plan.duration_s * plan.control_hz)
    total = float(steps + clocked)
    batch = _flown(replace(trial, through="batch"))
    lockstep = _flown(trial, lambda done: progress(float(done), total))
    clock = []
    for number in range(request.real_time):
        seed = plan.seed + number
        twin = _flown(replace(trial, through="batch", episodes=1, plan=replace(plan, seed=seed)))
        clock.append({"seed": seed, **_by_the_clock_or_error(trial, seed), "batch": twin})
        progress(steps + clocked * (number + 1) / request.real_time, total)
    required = requirements(batch, lockstep, clock)
    return {
        "robot": plan.robot,
        "task": plan.task,
        "controller": plan.controller,
        "control_hz": plan.control_hz,
        "scenario": plan.scenario,
        "seed": plan.seed,
        "episode_s": plan.duration_s,
        "episodes": trial.episodes,
        "batch": batch,
        "lockstep": lockstep,
        "realtime": clock,
        "required": required,
        "passed": all(row["passed"] for row in required),
    }


def _flown(trial: Trial, progress: Callable[[int], None] = lambda steps: None) -> dict[str, Any]:
    found = figures(join(list(runs_of(trial, progress))), trial.plan.task.removeprefix("fly_"), trial.robot)
    return {name: found[name] for name in SHOWN}


def _by_the_clock_or_error(trial: Trial, seed: int) -> dict[str, Any]:
    """As `_by_the_clock`; of a run that failed `error`, which keeps what others have flown."""
    try:
        return _by_the_clock(trial, seed)
    except RunFailed as error:
        return {
            **dict.fromkeys(SHOWN),
            "survival": 0.0,
            "period_error_ms": {"p99": None},
            "error": str(error),
        }


def _by_the_clock(trial: Trial, seed: int) -> dict[str, Any]:
    """One flight in real time, as `fulmar run` does it, with its bag."""
    plan = trial.plan
    with tempfile.TemporaryDirectory(prefix="fulmar_", ignore_cleanup_errors=True) as folder, own_domain():
        asked = replace(
            plan,
            start=(),
            lockstep=False,
            seed=seed,
            record=str(Path(folder) / "bag"),
            command="fulmar benchmark flights",
        )
        asked = checked(completed(asked))
        execution = execute(asked)
        record = read_run(Path(asked.record))
        result, summary = evaluate_run(record), summarise(record)
    if execution.failure or result is None:
        raise RunFailed(f"flight of seed {seed}: {execution.failure or 'nothing of it was recorded'}")
    found = figures(result.run, plan.task.removeprefix("fly_"), trial.robot)
    return {
        **{name: found[name] for name in SHOWN},
        "period_error_ms": summary["period_error_ms"],
        "latency_ms": summary["latency_ms"],
        "overruns": summary["overruns"],
        "watchdog_trips": summary["watchdog_trips"],
    }


def requirements(
    batch: dict[str, Any], lockstep: dict[str, Any], clock: list[dict[str, Any]]
) -> list[dict[str, Any]]:
    """What is required of figures through nodes, and whether it is met."""

    def line(what: str, value: float | None, limit: float) -> dict[str, Any]:
        return {
            "what": what,
            "value": value,
            "limit": limit,
            "passed": value is not None and value <= limit,
        }

    def apart(found: dict[str, Any], beside: dict[str, Any]) -> float | None:
        pair = found[ALTITUDE], beside[ALTITUDE]
        return None if None in pair else abs(pair[0] - pair[1])

    rows = [line("altitude RMSE in lock step, off the batch's [m]", apart(lockstep, batch), APART_M)]
    for each in clock:
        name = f"real time, seed {each['seed']}"
        rows.append(
            line(f"{name}: altitude RMSE off that in the batch [m]", apart(each, each["batch"]), APART_M)
        )
        rows.append(line(f"{name}: period error, p99 [ms]", each["period_error_ms"]["p99"], PERIOD_MS))
    return rows


def print_live(document: dict[str, Any], write: Callable[[str], None]) -> None:
    """Print the figures of every way, and what is required."""
    write(
        f"{document['robot']}, {document['task']} by {document['controller']} at {document['control_hz']:g} Hz, "
        f"{document['episode_s']:g} s, {document['scenario']}, seed {document['seed']}"
    )
    write(f"{'':24} {'altitude RMSE':>14} {'after 10 s':>11} {'peak':>7} {'alive':>6} {'period p99':>11}")
    ways = [("batch", document["batch"]), ("lock step", document["lockstep"])]
    ways += [(f"real time, seed {each['seed']}", each) for each in document["realtime"]]
    for name, found in ways:
        period = found.get("period_error_ms", {}).get("p99")
        write(
            f"{name:24} {_number(found[ALTITUDE]):>12} m {_number(found['late_altitude_rmse_m']):>9} m "
            f"{_number(found['peak_error_m']):>5} m {found['survival']:>6.2f} {_number(period):>8} ms"
        )
        if "error" in found:
            write(f"{'':24} {found['error']}")
    for row in document["required"]:
        write(
            f"{'met' if row['passed'] else 'NOT MET':8} {row['what']}: {_number(row['value'])} "
            f"(limit {row['limit']:g})"
        )


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.4f}"
