"""Run a fleet once, and say from its bag how every robot did and how near any two came."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_bags.contents import Bag, open_bag
from fulmar_bags.run_record import RunRecord, run_in
from fulmar_bringup.fleet_executor import FleetExecution, execute_fleet
from fulmar_bringup.fleet_plan import FleetPlan, formation_of
from fulmar_bringup.run_plan import RunPlan
from fulmar_core.robots.hull_distance import hull_distance
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.rotation import yaw_of
from fulmar_evaluation.formation_figures import MOST, RMS, shape_errors
from fulmar_evaluation.run_outcome import evaluate_execution
from fulmar_evaluation.run_summary import summary_text

KEPT_APART = "keep_apart_steps"  # of `controller/status`


@dataclass(frozen=True)
class FleetOutcome:
    """Result of a fleet's run."""

    summary: dict[str, Any]
    failure: str  # why the run did not come to its planned end, or what came too near; empty if neither
    records: Mapping[str, RunRecord] = field(default_factory=dict)  # of the robots whose bag could be read

    @property
    def exit_code(self) -> int:
        """0: every robot met its goal, and none came nearer to another than the limit; 1: otherwise."""
        return 0 if self.summary["success"] and not self.failure else 1


@dataclass(frozen=True)
class Nearest:
    """Least distance between any two hulls of a run."""

    distance_m: float
    robots: tuple[str, str]
    time_s: float  # on the clock of the stamps [s]


def run_fleet_and_evaluate(plan: FleetPlan) -> FleetOutcome:
    """Run once and evaluate the bag.

    Raises:
        ConfigError: As in `execute_fleet`.
    """
    return evaluate_fleet(plan, execute_fleet(plan))


def evaluate_fleet(plan: FleetPlan, execution: FleetExecution) -> FleetOutcome:
    """Evaluate a fleet's run that has ended, from its bag."""
    bags, records, outcomes = OpenBags(plan), dict[str, RunRecord](), {}
    for one in plan.robots:

        def read(_path: Path, one: RunPlan = one) -> RunRecord:
            return records.setdefault(one.robot_name, bags.record_of(one))

        outcomes[one.robot_name] = evaluate_execution(one, execution.robots[one.robot_name], read)
    for name, outcome in outcomes.items():
        outcome.summary[KEPT_APART] = interventions(records[name]) if name in records else None
    errors = shape_errors(records, {one.robot_name: formation_of(plan, one) for one in plan.robots})
    for name, error in errors.items():  # its goal moved: where it stood at the end says nothing
        met = error.rms_m <= plan.fleet.shape_error
        outcomes[name].summary.update({RMS: error.rms_m, MOST: error.most_m, "success": met})
    near = nearest(records)
    failures = [f"{name}: {outcome.failure}" for name, outcome in outcomes.items() if outcome.failure]
    failures = [*([execution.failure] if execution.failure else []), *failures]
    limit = plan.fleet.least_distance
    if near is not None and near.distance_m < limit:
        text = " and ".join(f"'{name}'" for name in near.robots)
        failures.append(
            f"{text} came within {near.distance_m:.3f} m of each other at t = {near.time_s:.1f} s; the fleet's "
            f"least_distance is {limit:g} m"
        )
    failure = "; ".join(failures)
    success = all(outcome.exit_code == 0 for outcome in outcomes.values())
    summary = {
        "fleet": plan.name,
        "seed": plan.seed,
        "lockstep": plan.lockstep,
        "success": success,
        "least_distance_m": None if near is None else near.distance_m,
        "least_distance_between": None if near is None else list(near.robots),
        "least_distance_limit_m": limit,
        "robots": {name: outcome.summary for name, outcome in outcomes.items()},
        "bag": plan.record if Path(plan.record).exists() else None,
        "failure": failure or None,
    }
    return FleetOutcome(summary, failure, records)


class OpenBags:
    """The bags of a fleet's run, each of which is read once."""

    def __init__(self, plan: FleetPlan) -> None:
        """Read nothing yet."""
        self._plan, self._bags = plan, dict[str, Bag]()

    def record_of(self, one: RunPlan) -> RunRecord:
        """Record of a robot.

        Raises:
            FulmarError: It cannot be read.
        """
        bag = self._bags.get(one.record)
        if bag is None:
            bag = self._bags[one.record] = open_bag(Path(one.record))
        robot = self._plan.robot_in_bag(one)
        return run_in(bag if robot is None else bag.of_robot(robot))


def interventions(record: RunRecord) -> int:
    """Control steps in which the guard held a robot back from another one."""
    counts = [
        int(each.values.get(KEPT_APART, 0)) for each in record.health if each.name.endswith(": controller")
    ]
    return max(counts, default=0)


def nearest(records: dict[str, RunRecord]) -> Nearest | None:
    """How near the hulls of any two robots came; None where no two were recorded at the same times.

    Args:
        records: Of the robots, by name.
    """
    found: list[Nearest] = []
    for (one, first), (other, second) in itertools.combinations(records.items(), 2):
        robots = load_robot(str(first.info["robot"])), load_robot(str(second.info["robot"]))
        stamps, mine, theirs = np.intersect1d(
            np.round(first.motion.stamp_s, 6), np.round(second.motion.stamp_s, 6), return_indices=True
        )
        if len(stamps):
            far = hull_distance(robots[0], _poses(first, mine), robots[1], _poses(second, theirs))
            least = int(np.argmin(far))
            found.append(Nearest(float(far[least]), (one, other), float(stamps[least])))
    return min(found, key=lambda each: each.distance_m, default=None)


def _poses(record: RunRecord, which: np.ndarray) -> np.ndarray:
    """Poses at some samples, shape (n, 3): x, y [m], heading [rad]."""
    motion = record.motion
    return np.column_stack((motion.position[which, :2], yaw_of(motion.quat_xyzw[which])))


def fleet_text(summary: dict[str, Any]) -> str:
    """A summary in some lines for people."""
    lines = []
    for name, own in summary["robots"].items():
        kept = own.get(KEPT_APART)
        if RMS in own:
            met = "" if own["success"] else ", FAILED"
            lines.append(f"{name}: {own[RMS]:.3f} m rms from its place, {own[MOST]:.3f} m at most{met}")
        else:
            lines.append(f"{name}: {summary_text(own).splitlines()[0]}")
        lines += [f"  {name} was held back from others in {kept} control steps"] if kept else []
        lines += [f"  {name} failed: {own['failure']}"] if own["failure"] else []
        lines += [f"  warning: {warning}" for warning in own["warnings"]]
    near = summary["least_distance_m"]
    if near is not None:
        between = " and ".join(summary["least_distance_between"])
        lines.append(f"least distance between two hulls: {near:.3f} m, {between}")
    bag = summary["bag"]
    own = [robot["bag"] for robot in summary["robots"].values() if robot["bag"] not in (None, bag)]
    bags = own or ([] if bag is None else [bag])
    lines += [f"recorded in {each}; fulmar bag info {each}" for each in bags] or ["nothing was recorded"]
    return "\n".join(lines)
