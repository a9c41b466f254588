"""Run a fleet once for each of several seeds, and sum up who arrived and how near robots came to one another.

The result of each seed is a file, so that an evaluation that was interrupted goes on where it was.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_bags.run_record import RunRecord
from fulmar_bringup.domains import reserved_domains
from fulmar_bringup.fleet_plan import FleetChoices, fleet_plan
from fulmar_core.config.atomic_write import write_whole
from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_path
from fulmar_core.config.process import environment
from fulmar_core.robots.robot_file import load_robot
from fulmar_evaluation.fleet_outcome import run_fleet_and_evaluate

STOPPED = "stopped by"  # how the reason of an end begins that a person asked for
APPLIED_AS_COMMANDED = 1e-6  # of a command, in what the plant applied
HELD_S = 1.0  # at most, that a plant applies a command without a newer one, by the wall clock [s]
SENT_BY_S = 0.005  # by which the time of sending a command may lie behind its arrival [s]


@dataclass(frozen=True)
class SeedResult:
    """What came of one seed.

    Attributes:
        seed: The seed.
        robots: Number of robots.
        arrived: Those that met their goals.
        least_m: Least distance between any two hulls, below 0 where they overlapped; None: not recorded [m].
        crossed: Robots whose plant applied what their own controller had not commanded.
        failure: Why the run failed; empty if it did not.
    """

    seed: int
    robots: int
    arrived: int
    least_m: float | None
    crossed: tuple[str, ...]
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
        duration_s: Length of each run; None: as long as the robot needs that needs longest [s].
    """

    fleet: str
    lockstep: bool = True
    keep_apart: bool = True
    duration_s: float | None = None

    @property
    def key(self) -> dict[str, Any]:
        """What a result has to agree on to count: also the text of the fleet's file."""
        text = config_path("systems", self.fleet).read_bytes()
        ways = {"lockstep": self.lockstep, "keep_apart": self.keep_apart, "duration_s": self.duration_s}
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
        read = SeedResult(**(result | {"crossed": tuple(result["crossed"])}))
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
        duration_s=choice.duration_s,
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
    crossed = crossed_robots(outcome.records, lockstep=choice.lockstep)
    found = SeedResult(seed, len(plan.robots), arrived, summary["least_distance_m"], crossed, outcome.failure)
    text = json.dumps({"about": choice.key, "result": vars(found), "summary": summary}, indent=2)
    folder.mkdir(parents=True, exist_ok=True)
    write_whole({path: text.encode()})
    if found.all_arrived and not found.failure and not found.touched and not crossed:
        shutil.rmtree(bag, ignore_errors=True)
    return found


def crossed_robots(records: Mapping[str, RunRecord], *, lockstep: bool) -> tuple[str, ...]:
    """Names of robots whose plant applied what their own controller had not commanded.

    Args:
        records: Of the robots, by name.
        lockstep: Whether what was applied at a time is the command of that very time; else it is one of those that
            were sent since the plant's watchdog would have tripped, the safe command, or what lies between both where
            actuators slew: after a trip of the watchdog the plant goes there step by step.
    """
    check = _applied_in_step if lockstep else _applied_by_the_clock
    return tuple(name for name, record in records.items() if not check(record))


def _applied_in_step(record: RunRecord) -> bool:
    _, mine, theirs = np.intersect1d(record.commanded.stamp_s, record.applied.stamp_s, return_indices=True)
    if not len(mine):
        return True  # nothing ran, which is the failure of that run
    commanded, applied = record.commanded.effort[mine], record.applied.effort[theirs]
    return bool(np.allclose(commanded, applied, atol=APPLIED_AS_COMMANDED))


def _applied_by_the_clock(record: RunRecord) -> bool:
    commanded, applied = record.commanded, record.applied
    actuators = load_robot(str(record.info["robot"])).actuators
    others = ~np.isclose(applied.effort, actuators.safe_command, atol=APPLIED_AS_COMMANDED).all(axis=1)
    sent_s = np.sort(commanded.publish_s)
    efforts = commanded.effort[np.argsort(commanded.publish_s, kind="stable")]
    begins = np.broadcast_to(actuators.safe_command, efforts.shape) if actuators.response.slew else efforts
    low = np.minimum(begins, efforts) - APPLIED_AS_COMMANDED
    high = np.maximum(begins, efforts) + APPLIED_AS_COMMANDED
    for time_s, effort in zip(applied.publish_s[others], applied.effort[others], strict=True):
        sent = slice(*np.searchsorted(sent_s, (time_s - HELD_S, time_s + SENT_BY_S)))
        if not ((low[sent] <= effort) & (effort <= high[sent])).all(axis=1).any():
            return False
    return True


def summed_up(choice: Choice, results: Sequence[SeedResult]) -> dict[str, Any]:
    """What an evaluation prints as JSON: each seed, and the sums of all."""
    nearest = [result.least_m for result in results if result.least_m is not None]
    return {
        "fleet": choice.fleet,
        "lockstep": choice.lockstep,
        "keep_apart": choice.keep_apart,
        "duration_s": choice.duration_s,
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
