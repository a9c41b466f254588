"""The shipped policies: their table, their recipes, and the jobs that make them."""

from __future__ import annotations

import hashlib
import itertools
import json
import shutil
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields, is_dataclass, replace
from pathlib import Path
from typing import Any

from fulmar_core.config.errors import BundleError
from fulmar_core.config.paths import config_directory
from fulmar_core.config.strict_yaml import load_config
from fulmar_core.loop.policy_bundle import FORMAT, read_passport
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import Scenario, load_scenario
from training.executors import Executor, Watch
from training.fallback_policy import fallback_settings
from training.jobs import Job, Outcome
from training.settings import Clone, TrainingSettings, load_training_settings

UPDATES_A_SECOND = 5.0  # of one run on one idle core, where nothing better is known


@dataclass(frozen=True)
class ShippedPolicy:
    """One line of the table."""

    robot: str
    task: str
    seed: int
    updates: int  # of its training; not a time, so that a busy machine makes the same policy as an idle one
    success: float  # what it has to reach in MuJoCo [-]

    @property
    def name(self) -> str:
        """Name of its bundle."""
        return f"{self.robot}_{self.task}"


@dataclass(frozen=True)
class PolicyTable:
    """What `configs/policies.yaml` says."""

    at_once: int  # runs side by side
    episodes: int  # of the evaluation in MuJoCo
    policies: tuple[ShippedPolicy, ...]

    def __post_init__(self) -> None:
        names = [policy.name for policy in self.policies]
        if len(set(names)) != len(names):
            raise ValueError("'policies' has two lines for one robot and task.")
        if min(self.at_once, self.episodes) < 1:
            raise ValueError("'at_once' and 'episodes' must be at least 1.")


def load_policy_table() -> PolicyTable:
    """Read `configs/policies.yaml`.

    Raises:
        ConfigError: A mistake in the file.
    """
    return load_config(PolicyTable, config_directory() / "policies.yaml")


def recipe(policy: ShippedPolicy, settings: TrainingSettings) -> str:
    """Hash of a policy's inputs: robot, task, scenario, settings, seed and number of updates.

    Values at their default do not count, so that a new option keeps the recipes of policies without it.
    """
    scenario = load_scenario(settings.scenario)
    ingredients = {
        "robot": _as_trained(load_robot(policy.robot), scenario, sees=isinstance(settings.algorithm, Clone)),
        "task": _chosen(load_task(policy.task)),
        "scenario": _chosen(scenario),
        "settings": _chosen(settings),
        "policy": asdict(policy) | {"success": None},
        "format": FORMAT,
    }
    if own := fallback_settings(settings, load_robot(policy.robot), load_task(policy.task)):
        ingredients["fallback_policy"] = [_chosen(own), _chosen(load_scenario(own.scenario))]
    return hashlib.sha256(json.dumps(ingredients, sort_keys=True, default=str).encode()).hexdigest()[:16]


def _as_trained(robot: Robot, scenario: Scenario, *, sees: bool) -> Any:
    """A robot as batches have it: on air, its supply full, and without what neither scenario nor policy reads."""
    tank = robot.actuators.tank
    # A tank that is a part of the body empties in batches too.
    actuators: Any = robot.actuators if tank is None or tank.weighs else replace(robot.actuators, tank=None)
    camera = robot.sensors.camera if sees else None
    sensors = replace(robot.sensors, supply=None, fuel=None, camera=camera)
    spans = robot.morphology if scenario.body == "morphology" else None
    same = replace(robot, air_bearing=False, usual_controller="", morphology=spans, look=())
    found = _chosen(replace(same, actuators=actuators, sensors=sensors))
    del found["sensors"]["own"]
    return found


def _chosen(values: Any) -> Any:
    """A dataclass as a dictionary, without what is at its default."""
    if is_dataclass(values) and not isinstance(values, type):
        found = {field: getattr(values, field.name) for field in fields(values)}
        return {field.name: _chosen(value) for field, value in found.items() if value != field.default}
    if isinstance(values, tuple | list):
        return [_chosen(value) for value in values]
    return values


def policy_job(
    policy: ShippedPolicy, *, episodes: int, runs: Path, bundles: Path, command: str, git_revision: str
) -> Job:
    """The job that makes a policy.

    Args:
        policy: Line of the table.
        episodes: Of the evaluation in MuJoCo.
        runs: Folder of the run folders; a run that was broken off there is resumed.
        bundles: Folder of the bundles.
        command: Command line, for the record.
        git_revision: Commit of the code, for the record.
    """
    settings = load_training_settings(load_robot(policy.robot), load_task(policy.task))
    made_from = recipe(policy, settings)
    return Job(
        policy.name,
        policy.robot,
        policy.task,
        policy.seed,
        settings,
        runs / f"{policy.name}_{made_from[:8]}",
        updates=policy.updates,
        episodes=episodes,
        bundle=bundles / policy.name,
        recipe=made_from,
        command=command,
        git_revision=git_revision,
    )


def is_made(job: Job) -> bool:
    """Whether a job's bundle exists, is intact and up to date."""
    assert job.bundle is not None
    try:
        passport = read_passport(job.bundle)
    except BundleError:
        return False
    return passport.training.get("recipe") == job.recipe


def expected_s(jobs: Sequence[Job], at_once: int) -> float:
    """Expected time of learning on `at_once` cores [s], from the last run of each job, or from its updates."""
    each = [_took_s(job) for job in jobs]
    return max([sum(each) / at_once, *each])


def _took_s(job: Job) -> float:
    assert job.bundle is not None
    try:
        return float(read_passport(job.bundle).training["wall_s"])
    except (BundleError, LookupError):
        return (job.updates or 0) / UPDATES_A_SECOND


def set_aside(job: Job) -> Path | None:
    """Move a job's run folder and bundle aside, so that the job runs again; returns the new place, None if empty."""
    assert job.bundle is not None
    if not (job.out.exists() or job.bundle.exists()):
        return None
    aside = next(
        place for number in itertools.count(1) if not (place := Path(f"{job.out}.{number}")).exists()
    )
    if job.out.exists():
        job.out.rename(aside)
    aside.mkdir(parents=True, exist_ok=True)
    if job.bundle.exists():
        shutil.move(job.bundle, aside / "bundle")
    return aside


def make_policies(
    table: PolicyTable, jobs: Sequence[Job], executor: Executor, watch: Watch
) -> list[dict[str, Any]]:
    """Make the bundles that are missing or out of date.

    Args:
        table: Has the success that each policy needs.
        jobs: One for each line of the table that is asked for.
        executor: Runs them.
        watch: Receives their progress; numbers count the jobs that run.

    Returns:
        One line for each job: name, whether it was made now, success in MuJoCo, what it has to be, what went wrong.
    """
    missing = [job for job in jobs if not is_made(job)]
    outcomes = {outcome.job.name: outcome for outcome in executor.run(missing, watch)} if missing else {}
    needed = {policy.name: policy.success for policy in table.policies}
    return [_line(job, needed[job.name], outcomes.get(job.name)) for job in jobs]


def _line(job: Job, needed: float, outcome: Outcome | None) -> dict[str, Any]:
    line: dict[str, Any] = {"policy": job.name, "made": outcome is not None, "needed": needed}
    if outcome is not None and outcome.record is None:
        return line | {"success": None, "good": False, "error": outcome.error}
    assert job.bundle is not None
    training = read_passport(job.bundle).training
    success = training.get("mujoco", {}).get("success_rate")
    return line | {
        "success": success,
        "good": success is not None and success >= needed,
        "wall_s": training["wall_s"],
        "steps": training["steps"],
    }
