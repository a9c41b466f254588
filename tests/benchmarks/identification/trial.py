"""One machine: driven into bags, identified from them, compared with the truth."""

from __future__ import annotations

import json
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fulmar_core.actuators.differential_drive import DifferentialDrive
from fulmar_core.identification.identify import Weight, identify
from fulmar_core.robot import load_robot
from fulmar_evaluation.driven_run import driven_run
from tests.benchmarks.identification.driving import drive, speeds_of_wheels
from tests.benchmarks.identification.machines import draw_machine

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
