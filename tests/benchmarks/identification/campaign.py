"""Many machines: each driven into bags, identified from them and compared with the truth."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_benchmarks.pool import pool_of
from fulmar_core.robots.actuators.differential_drive import DifferentialDrive
from fulmar_core.robots.robot_file import load_robot
from fulmar_evaluation.driven_run import driven_run
from fulmar_evaluation.identification.identify import Weight, identify
from tests.benchmarks.identification.driving import draw_machine, drive, speeds_of_wheels

# Long enough that the intervals are a third of what is asked for, and short enough for one tank of air.
DURATION_S = {"thrusters": 120.0, "propellers": 240.0, "differential_drive": 120.0}


@dataclass(frozen=True)
class Trial:
    """What to do."""

    robot: str
    number: int
    seed: int
    duration_s: float | None = None  # of each run; the usual of the family by default [s]
    bags: Path | None = None  # where bags are kept; None: they are not


def run_trial(trial: Trial) -> dict[str, Any]:
    """Drive and identify one machine.

    Returns:
        `robot`, `number`, and for each quantity with a truth `truth`, `value`, `low`, `high`, `inside`, and
        `error_percent` where the truth is not 0.
    """
    nominal = load_robot(trial.robot)
    machine = draw_machine(nominal, trial.seed, trial.number)
    if isinstance(nominal.actuators, DifferentialDrive):
        machine.truth.update(speeds_of_wheels(machine))
    duration_s = trial.duration_s or DURATION_S[nominal.actuators.kind]
    with tempfile.TemporaryDirectory() as scratch:
        home = (trial.bags or Path(scratch)) / f"{trial.robot}_{trial.number:02d}"
        drives, weights = [], {}
        for load, leg in enumerate(machine.legs):
            noise = 1000 * trial.seed + 10 * trial.number + load
            bag = drive(machine, leg, nominal, home / leg.name, seed=noise, duration_s=duration_s)
            drives.append(driven_run(bag, load=load)[1])
            if leg.ballast:
                weights[load] = Weight(*leg.ballast)
        if trial.bags is not None:
            (home / "truth.json").write_text(json.dumps(machine.truth, indent=2) + "\n", encoding="utf-8")
        found = identify(nominal, drives, ballasts=weights)
    quantities = {}
    for name, truth in machine.truth.items():
        e = found.fit.estimates[name]
        quantities[name] = {
            "truth": truth,
            "value": e.value,
            "low": e.low,
            "high": e.high,
            "unit": e.unit,
            "error_percent": 100.0 * abs(e.value / truth - 1.0) if truth else None,
            "inside": bool(e.low <= truth <= e.high),
        }
    return {"robot": trial.robot, "number": trial.number, "quantities": quantities}


ASKED = ("mass", "yaw_inertia", "thrust")  # of platforms
MOST_ERROR_PERCENT = 3.0
LEAST_COVERAGE = 0.9
PLATFORM = "floating_platform"


def run_identification(
    trials: Sequence[Trial], *, jobs: int, on_done: Callable[[dict[str, Any]], None] = lambda result: None
) -> list[dict[str, Any]]:
    """Run trials in processes of their own, or on a cluster; results in the order of the trials."""
    results: dict[int, dict[str, Any]] = {}

    def note(index: int, result: Any) -> None:
        if isinstance(result, Exception):
            raise result
        results[index] = result
        on_done(result)

    pool_of(jobs).run(run_trial, [(trial,) for trial in trials], on_done=note, watch=lambda _: None)
    return [results[i] for i in range(len(trials))]


def document_of(results: Sequence[dict[str, Any]], *, seed: int) -> dict[str, Any]:
    """Figures of every robot's quantities, each machine's own numbers, and what was asked beside what was found."""
    robots = list(dict.fromkeys(result["robot"] for result in results))
    figures = {robot: _figures([r for r in results if r["robot"] == robot]) for robot in robots}
    asked = [
        {
            "quantity": name,
            "worst_error_percent": figures[PLATFORM][name]["worst_error_percent"],
            "most_error_percent": MOST_ERROR_PERCENT,
            "coverage": figures[PLATFORM][name]["coverage"],
            "least_coverage": LEAST_COVERAGE,
            "met": figures[PLATFORM][name]["worst_error_percent"] <= MOST_ERROR_PERCENT
            and figures[PLATFORM][name]["coverage"] >= LEAST_COVERAGE,
        }
        for name in ASKED
        if PLATFORM in figures
    ]
    return {
        "seed": seed,
        "figures": figures,
        "required": asked,
        "asked": len(asked),
        "met": sum(line["met"] for line in asked),
        "machines": list(results),
    }


def _figures(results: Sequence[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    figures = {}
    for name, first in results[0]["quantities"].items():
        every = [result["quantities"][name] for result in results]
        errors = [each["error_percent"] for each in every if each["error_percent"] is not None]
        off = [abs(each["value"] - each["truth"]) for each in every]
        figures[name] = {
            "unit": first["unit"],
            "machines": len(every),
            "mean_error_percent": float(np.mean(errors)) if errors else None,
            "worst_error_percent": float(np.max(errors)) if errors else None,
            "worst_error": float(np.max(off)),
            "mean_half_width": float(np.mean([0.5 * (each["high"] - each["low"]) for each in every])),
            "coverage": float(np.mean([each["inside"] for each in every])),
        }
    return figures
