"""Run a fleet once for each of several seeds, and sum up who arrived and how near robots came to one another.

The result of each seed is a file, so that an evaluation that was interrupted goes on where it was.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_bringup.domains import reserved_domains
from fulmar_bringup.fleet_plan import FleetChoices, FleetPlan, fleet_plan
from fulmar_core.config.atomic_write import write_whole
from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_path
from fulmar_core.config.process import environment
from fulmar_evaluation.fleet_outcome import records_of, run_fleet_and_evaluate

STOPPED = "stopped by"  # how the reason of an end begins that a person asked for
APPLIED_AS_COMMANDED = 1e-6  # of a command, in what the plant applied at the same stamp


@dataclass(frozen=True)
class SeedResult:
    """What came of one seed.

    Attributes:
        seed: The seed.
        robots: Number of robots.
        arrived: Those that met their goals.
        least_m: Least distance between any two hulls, below 0 where they overlapped; None: not recorded [m].
        crossed: Robots whose plant applied what their own controller had not commanded; None by the clock, where what
            is applied at a time is the command of an earlier one.
        failure: Why the run failed; empty if it did not.
    """

    seed: int
    robots: int
    arrived: int
    least_m: float | None
    crossed: tuple[str, ...] | None
    failure: str

    @property
    def touched(self) -> bool:
        """Whether any two hulls touched."""
        return self.least_m is not None and self.least_m <= 0.0

    @property
    def all_arrived(self) -> bool:
        """Whether every robot met its goals."""
        return self.arrived == self.robots


@dataclass(frozen=True)
class Choice:
    """What a fleet is evaluated with.

    Attributes:
        fleet: Name of its file.
        lockstep: Whether in lock step; else in real time.
        keep_apart: Whether the guards act.
    """

    fleet: str
    lockstep: bool = True
    keep_apart: bool = True

    @property
    def key(self) -> dict[str, Any]:
        """What a result has to agree on to count: also the text of the fleet's file."""
        text = config_path("systems", self.fleet).read_bytes()
        ways = {"lockstep": self.lockstep, "keep_apart": self.keep_apart}
        return {"fleet": self.fleet, **ways, "file_sha256": hashlib.sha256(text).hexdigest()}


def evaluate_seeds(
    choice: Choice, seeds: Sequence[int], folder: Path, progress: Callable[[SeedResult], None]
) -> list[SeedResult]:
    """Run a fleet once for each seed, one after another, in a ROS domain of their own.

    Args:
        choice: What is run.
        seeds: Which.
        folder: Of the results; a seed whose result of this very fleet lies there is not run again. Bags of seeds that
            failed stay there, too.
        progress: Called with each result.

    Raises:
        ConfigError: The fleet cannot run, or the results in the folder are of something else.
        KeyboardInterrupt: A person stopped it; results so far stay.
    """
    results = []
    with reserved_domains(1) as (domain,), environment({"ROS_DOMAIN_ID": str(domain)}):
        for seed in seeds:
            path = folder / f"seed_{seed:03d}.json"
            found = _read(path, choice) or _run(choice, seed, folder, path)
            progress(found)
            results.append(found)
    return results


def _read(path: Path, choice: Choice) -> SeedResult | None:
    if not path.exists():
        return None
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        own, result = found["about"], found["result"]
        crossed = None if result["crossed"] is None else tuple(result["crossed"])
        read = SeedResult(**(result | {"crossed": crossed}))
    except (json.JSONDecodeError, KeyError, TypeError) as error:
        raise ConfigError(
            f"{path} is no result of a seed: {error!r}. Delete it, or give --results."
        ) from error
    if own != choice.key:
        raise ConfigError(f"{path} is of another fleet or way to run it. Give another folder: --results DIR.")
    return read


def _run(choice: Choice, seed: int, folder: Path, path: Path) -> SeedResult:
    bag = folder / f"seed_{seed:03d}"
    if bag.exists():
        shutil.rmtree(bag)  # of a run that was interrupted
    asked = FleetChoices(
        seed=seed,
        lockstep=choice.lockstep,
        keep_apart=choice.keep_apart,
        record=bag,
        command="fulmar evaluate",
    )
    plan = fleet_plan(choice.fleet, asked)
    # How near robots come is counted here; a limit of the file would fail what is to be measured without guards.
    plan = plan if choice.keep_apart else replace(plan, fleet=replace(plan.fleet, least_distance=0.0))
    outcome = run_fleet_and_evaluate(plan)
    if outcome.failure.startswith(STOPPED):
        raise KeyboardInterrupt(outcome.failure)  # no result of this seed: it runs again
    summary = outcome.summary
    arrived = sum(robot["success"] is True and not robot["failure"] for robot in summary["robots"].values())
    crossed = crossed_robots(plan) if choice.lockstep else None
    found = SeedResult(seed, len(plan.robots), arrived, summary["least_distance_m"], crossed, outcome.failure)
    text = json.dumps({"about": choice.key, "result": vars(found), "summary": summary}, indent=2)
    folder.mkdir(parents=True, exist_ok=True)
    write_whole({path: text.encode()})
    if found.all_arrived and not found.failure and not found.touched and not crossed:
        shutil.rmtree(bag, ignore_errors=True)
    return found


def crossed_robots(plan: FleetPlan) -> tuple[str, ...]:
    """Names of robots whose plant applied, in lock step, what their own controller had not commanded."""
    found = []
    for name, record in records_of(plan):
        _, mine, theirs = np.intersect1d(
            record.commanded.stamp_s, record.applied.stamp_s, return_indices=True
        )
        if not len(mine):
            continue  # nothing ran, which is the failure of that run
        commanded, applied = record.commanded.effort[mine], record.applied.effort[theirs]
        if not np.allclose(commanded, applied, atol=APPLIED_AS_COMMANDED):
            found.append(name)
    return tuple(found)


def summed_up(choice: Choice, results: Sequence[SeedResult]) -> dict[str, Any]:
    """What an evaluation prints as JSON: each seed, and the sums of all."""
    nearest = [result.least_m for result in results if result.least_m is not None]
    return {
        "fleet": choice.fleet,
        "lockstep": choice.lockstep,
        "keep_apart": choice.keep_apart,
        "seeds": [vars(result) for result in results],
        "count": len(results),
        "all_arrived": sum(result.all_arrived for result in results),
        "touched": sum(result.touched for result in results),
        "crossed": sum(bool(result.crossed) for result in results),
        "failed": sum(bool(result.failure) for result in results),
        "least_distance_m": min(nearest, default=None),
    }


def line_of(result: SeedResult) -> str:
    """One seed in a line for people."""
    near = "not recorded" if result.least_m is None else f"{result.least_m:.3f} m"
    words = [f"seed {result.seed}: {result.arrived} of {result.robots} arrived, least distance {near}"]
    words += ["hulls touched"] if result.touched else []
    words += [f"commands of another robot reached {', '.join(result.crossed)}"] if result.crossed else []
    words += [result.failure] if result.failure else []
    return "; ".join(words)
