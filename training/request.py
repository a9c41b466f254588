"""From the options of `fulmar train` to a checked job; nothing is learned here."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.provenance import git_revision
from fulmar_core.robots.robot_file import load_robot, use_calibration
from fulmar_core.simulation.counts import check_count, check_episodes
from fulmar_core.tasks import load_task
from sim_nodes.camera.opengl import check_loadable
from training.dreamer_process import dreamer_python
from training.executors import Executor, LocalExecutor
from training.jobs import Job
from training.ray_executor import RayExecutor
from training.run_folder import CALIBRATION_FILE, SETTINGS_FILE, read_start, write_start
from training.settings import Clone, Dreamer, StopAtSuccess, load_training_settings
from training.train import check_seed


@dataclass(frozen=True)
class TrainingRequest:
    """The options of `fulmar train`; None where one was not given."""

    robot: str | None
    task: str | None
    seed: int
    seeds: int  # runs of a campaign; 1: a single run
    time_limit_s: float | None  # wall-clock [s]
    updates: int | None
    stop_at_success: float | None
    settings: str | None
    control_hz: float | None
    out: Path | None
    episodes: int  # of the evaluation in MuJoCo
    calibration: Path | None
    resume: Path | None
    executor: str  # local or ray
    address: str | None  # of a Ray cluster
    wandb: bool
    command: str  # command line, for the record


def job_of(request: TrainingRequest) -> Job:
    """The job that a request describes; for a campaign that of its first seed.

    Raises:
        ConfigError: Options that exclude one another, an unknown name or an impossible value.
    """
    _check_options(request)
    if request.calibration is not None:
        use_calibration(request.calibration, request.robot or "")
    job = Job(
        name="",
        **(_new(request) if request.resume is None else _resumed(request.resume)),
        episodes=request.episodes,
        wandb="fulmar" if request.wandb else "",
        command=request.command,
        git_revision=git_revision(),
    )
    if request.time_limit_s is not None or request.updates is not None:
        job = replace(job, time_limit_s=request.time_limit_s, updates=request.updates)
    settings = job.settings
    check_loadable()  # it is evaluated in MuJoCo in the end
    if request.stop_at_success is not None:
        settings = replace(settings, stop_at_success=StopAtSuccess(request.stop_at_success))
    if request.control_hz is not None:
        settings = replace(settings, control_hz=request.control_hz)
        settings.learner_of(load_robot(job.robot))  # rejects a rate that the robot cannot keep
    if isinstance(settings.algorithm, Dreamer):
        _check_dreamer(request)
    if isinstance(settings.algorithm, Clone) and request.wandb:
        raise ConfigError("--wandb takes no curves of cloning from images. Leave it out.")
    robot = load_robot(job.robot)
    hz = settings.control_hz or robot.timing.control_hz
    check_count("--seeds", request.seeds)
    check_episodes(robot, episodes=job.episodes, steps=round(load_task(job.task).episode_s * hz))
    for seed in range(job.seed, job.seed + request.seeds):
        check_seed(seed)  # all of them, before anything is made
    if request.resume and (request.time_limit_s is not None or request.updates is not None):
        limits = {"time_limit_s": job.time_limit_s, "updates": job.updates}
        write_start(job.out, read_start(job.out) | limits)  # a later --resume keeps them
    return replace(job, settings=settings, name=f"{job.robot}_{job.task}_{job.seed}")


def _check_options(request: TrainingRequest) -> None:
    """Reject options that exclude one another."""
    r = request
    if r.executor not in ("local", "ray"):
        raise ConfigError(f"--executor {r.executor}: must be local or ray.")
    if r.resume and (r.robot or r.task or r.settings or r.out or r.seed != 1):
        raise ConfigError(
            "--resume goes on with what the run began with; leave ROBOT, TASK, --seed, --settings and --out out."
        )
    if r.resume and r.seeds > 1:
        raise ConfigError(
            "--resume and --seeds exclude one another: resume the runs of a campaign one by one."
        )
    if r.stop_at_success == 0.0:
        raise ConfigError("--stop-at-success 0 would stop at once; it must be greater than 0, and at most 1.")
    if r.control_hz is not None and r.resume:
        raise ConfigError("--resume goes on at the rate that the run began with; leave --control-hz out.")
    if r.calibration is not None and r.resume:
        raise ConfigError(
            "--resume goes on with the calibration that the run began with; leave --calibration out."
        )
    if r.address and r.executor == "local":
        raise ConfigError(
            "--address is of a Ray cluster: give --ray ADDRESS alone, or --executor ray beside it."
        )
    if (r.executor == "ray" or r.address) and r.seeds == 1:
        raise ConfigError(
            "--ray, --executor ray and --address are for campaigns: give --seeds N, or leave them out."
        )


def _check_dreamer(request: TrainingRequest) -> None:
    """Reject what DreamerV3 in its own environment cannot do, and a missing environment."""
    if request.wandb:
        raise ConfigError(
            "--wandb does not take the curves of dreamer: they are in tensorboard/ of the run folder."
        )
    if request.executor == "ray" or request.address:
        raise ConfigError("--ray does not run dreamer, whose environment is on this machine. Leave it out.")
    dreamer_python()


def _new(request: TrainingRequest) -> dict[str, Any]:
    """Robot, task, seed, settings and an empty folder of a new run."""
    robot, task = request.robot, request.task
    if robot is None or task is None:
        raise ConfigError("ROBOT and TASK are needed, or --resume RUN. Try `fulmar train --help`.")
    last = "seeds" if request.seeds > 1 else str(request.seed)
    out = request.out or Path("runs/train") / f"{time.strftime('%Y%m%d_%H%M%S')}_{robot}_{task}_{last}"
    if out.is_dir() and any(out.iterdir()):
        raise ConfigError(f"{out} is not empty; nothing recorded is overwritten. Give --out another folder.")
    the_robot, the_task = load_robot(robot), load_task(task)
    the_task.check(the_robot)
    settings = load_training_settings(the_robot, the_task, request.settings)
    return {"robot": robot, "task": task, "seed": request.seed, "settings": settings, "out": out}


def _resumed(run: Path) -> dict[str, Any]:
    """Robot, task, seed, limits and settings that a run began with."""
    start = read_start(run)
    if (run / CALIBRATION_FILE).is_file():
        use_calibration(run / CALIBRATION_FILE, start["robot"])
    robot, task = load_robot(start["robot"]), load_task(start["task"])
    return start | {"settings": load_training_settings(robot, task, str(run / SETTINGS_FILE)), "out": run}


def executor_of(request: TrainingRequest) -> Executor:
    """What runs the jobs of a campaign: processes of this machine, or a Ray cluster."""
    return RayExecutor(request.address) if request.executor == "ray" else LocalExecutor()
