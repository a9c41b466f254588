"""Training of a new bundle on the robot as it was identified, by the recipe of the shipped policy."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from fulmar_core.config.errors import ConfigError, RunFailed
from fulmar_core.config.provenance import git_revision

if TYPE_CHECKING:
    from training.jobs import Job


def training_job(
    robot: str, task: str, *, updates: int | None, runs: Path, bundles: Path, command: str
) -> Job:
    """The job that trains a robot, as calibrated, for a task.

    Settings, seed and number of updates are those of the shipped policy; where `configs/policies.yaml` has none for
    this robot and task, the settings of `fulmar train` and the updates of the policy that is most like it.

    Args:
        robot: Name of the robot.
        task: Name of the task.
        updates: Number of updates in their place; None: as shipped.
        runs: Folder of the run folders; a run that was broken off there is resumed.
        bundles: Folder of the bundle.
        command: Command line, for the record.

    Raises:
        ConfigError: No policy is shipped for any robot of its kind, and no number of updates is given.
    """
    from training.advice import usual_training
    from training.policies import ShippedPolicy, load_policy_table, policy_job

    rows = (row for row in load_policy_table().policies if (row.robot, row.task) == (robot, task))
    shipped = next(rows, None)
    usual = usual_training(robot, task) if shipped is None and updates is None else None
    if shipped is None and updates is None and usual is None:
        raise ConfigError(
            f"no policy is shipped that says how long '{robot}' learns '{task}'. Give --updates N."
        )
    seed = shipped.seed if shipped else 1
    count = updates or (shipped.updates if shipped else int(usual["updates"]) if usual else 1)
    return policy_job(
        ShippedPolicy(robot, task, seed, count, 0.0),
        episodes=0,
        runs=runs,
        bundles=bundles,
        command=command,
        git_revision=git_revision(),
    )


def train_bundle(job: Job) -> dict[str, Any]:
    """Train, or go on with a training that was broken off, and export the bundle.

    Returns:
        Ready for JSON: `run`, `recipe`, `updates`, `seed`, `steps`, `wall_s`, `sha256` of the bundle and `success_rate`
        on held-out episodes in the batch.

    Raises:
        RunFailed: It learned nothing that can be exported.
        KeyboardInterrupt: The user stopped it; the next call goes on.
    """
    from fulmar_core.loop.policy_bundle import read_passport
    from training.jobs import run_job
    from training.progress import LearningBar
    from training.run_folder import learning_in

    with learning_in(job.out):
        try:
            record = run_job(job, LearningBar(job.out))
        except ConfigError as error:
            raise RunFailed(f"{job.out}: {error}") from error
    if record.get("interrupted"):
        raise KeyboardInterrupt
    assert job.bundle is not None
    return {
        "run": str(job.out),
        "recipe": job.recipe,
        "updates": job.updates,
        "seed": job.seed,
        "steps": record["steps"],
        "wall_s": record["wall_s"],
        "success_rate": record["best"]["success_rate"],
        "sha256": read_passport(job.bundle).sha256,
    }
