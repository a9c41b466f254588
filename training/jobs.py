"""One training run as a job: learn, evaluate in MuJoCo, export."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from stable_baselines3.common.logger import KVWriter

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.calibration import calibration_path
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import Task, load_task
from training.dreamer_training import train_dreamer
from training.fallback_policy import FallbackPolicy, fallback_settings, load_fallback
from training.progress import Watcher, progress_file
from training.run_folder import (
    CALIBRATION_FILE,
    CHECKPOINT_FILE,
    FALLBACK_FOLDER,
    PROGRESS_FILE,
    read_run_record,
    write_run_record,
)
from training.settings import Clone, Dreamer, TrainingSettings
from training.train import begin_run, check_seed, train


@dataclass(frozen=True)
class Job:
    """Description of a training run and of what follows it."""

    name: str  # for tables
    robot: str
    task: str
    seed: int
    settings: TrainingSettings
    out: Path  # run folder; an unfinished run in it is resumed
    time_limit_s: float | None = None  # the settings' by default [s]
    updates: int | None = None
    episodes: int = 0  # of the evaluation in MuJoCo; 0: none
    bundle: Path | None = None  # folder to export to
    wandb: str = ""  # project on Weights & Biases that curves go to; empty: none
    recipe: str = ""  # hash of what it is made from, for the record
    command: str = ""
    git_revision: str = ""


@dataclass(frozen=True)
class Outcome:
    """Result of a job."""

    job: Job
    record: dict[str, Any] | None  # None if it failed
    error: str = ""

    @property
    def success(self) -> float:
        """Success rate in MuJoCo if it was evaluated there, else of the best check; -1 if the job failed."""
        if self.record is None:
            return -1.0
        mujoco = self.record.get("mujoco")
        return float(mujoco["success_rate"] if mujoco else self.record["best"]["success_rate"])


def run_job(job: Job, watcher: Watcher | None = None) -> dict[str, Any]:
    """Do what a job asks for and its folder does not have yet; returns the run's record.

    Progress goes to `watcher`, by default to `progress.json` in the job's folder.
    """
    record = _finished(job) or learn(job, watcher or progress_file(job.out / PROGRESS_FILE))
    if job.episodes and record.get("mujoco", {}).get("episodes") != job.episodes:
        from training.evaluator import evaluate_in_mujoco

        evaluate_in_mujoco(job.out, episodes=job.episodes)
    if job.bundle is not None:
        from training.export import export

        export(job.out, job.bundle)
    return read_run_record(job.out)


def learn(job: Job, watcher: Watcher) -> dict[str, Any]:
    """Learn only, from the checkpoint of the job's folder if there is one; returns the run's record."""
    check_seed(job.seed)  # before anything is written
    job.out.mkdir(parents=True, exist_ok=True)
    calibration = calibration_path()
    if calibration is not None and calibration != (job.out / CALIBRATION_FILE).absolute():
        (job.out / CALIBRATION_FILE).write_bytes(calibration.read_bytes())
    robot, task = job.settings.learner_of(load_robot(job.robot)), load_task(job.task)
    settings = fallback_settings(job.settings, robot, task)
    if settings is None:
        record = _train(job, robot, task, watcher)
    else:
        begin_run(robot, task, job.settings, **_limits(job))
        first, rest = _shared(job, settings)
        learned = _finished(first) or _train(first, robot, task, watcher)
        record = _train(rest, robot, task, watcher, load_fallback(first.out, robot, settings))
        record["fallback_policy"] = {
            key: learned[key] for key in ("steps", "updates", "wall_s", "best", "settings")
        }
    if job.recipe:
        record["recipe"] = job.recipe
    write_run_record(job.out, record)
    return record


def _train(
    job: Job, robot: Robot, task: Task, watcher: Watcher, fallback: FallbackPolicy | None = None
) -> dict[str, Any]:
    made_by = {"command": job.command, "git_revision": job.git_revision}
    shared: dict[str, Any] = {**_limits(job), **made_by, "watcher": watcher}
    if isinstance(job.settings.algorithm, Dreamer):
        return train_dreamer(robot, task, job.settings, **shared)
    if isinstance(
        job.settings.algorithm, Clone
    ):  # it has no checkpoint: a run that was broken off begins anew
        from training.image_cloning import train_from_images  # only here: it needs a renderer

        begin_run(robot, task, job.settings, **_limits(job))
        return train_from_images(robot, task, job.settings, **shared)
    resume = (job.out / CHECKPOINT_FILE).is_file()
    return train(robot, task, job.settings, **shared, resume=resume, fallback=fallback, curves=_curves(job))


def _limits(job: Job) -> dict[str, Any]:
    return {"seed": job.seed, "out": job.out, "time_limit_s": job.time_limit_s, "updates": job.updates}


def _shared(job: Job, settings: TrainingSettings) -> tuple[Job, Job]:
    """The part of a job that trains the fallback policy, and the rest."""
    assert job.settings.fallback_policy is not None
    share = job.settings.fallback_policy.share
    first = replace(job, settings=settings, out=job.out / FALLBACK_FOLDER, wandb="", recipe="")
    if job.updates is not None:
        updates = max(1, round(share * job.updates))
        first, job = replace(first, updates=updates), replace(job, updates=max(1, job.updates - updates))
    if job.updates is None or job.time_limit_s is not None:
        limit = job.time_limit_s or job.settings.time_limit_s
        first, job = (
            replace(first, time_limit_s=share * limit),
            replace(job, time_limit_s=limit - share * limit),
        )
    return first, job


def _curves(job: Job) -> KVWriter | None:
    if not job.wandb:
        return None
    from training.progress import WandbCurves

    return WandbCurves(job.out, project=job.wandb, name=job.name, settings=asdict(job.settings))


def _finished(job: Job) -> dict[str, Any] | None:
    """The record of a finished run; None if it is unfinished or missing."""
    try:
        record = read_run_record(job.out)
    except ConfigError:
        return None
    return None if record.get("interrupted") else record


def read_progress(job: Job) -> dict[str, Any]:
    """Progress of a job: `share`, `steps`, `rate` and `success`; empty before it begins."""
    try:
        return dict(json.loads((job.out / PROGRESS_FILE).read_text(encoding="utf-8")))
    except (OSError, ValueError):
        return {}
