"""Plan of a training that learns one task after another, and its record in the run folder."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fulmar_core.config.atomic_write import write_whole
from fulmar_core.config.errors import ConfigError
from fulmar_core.config.provenance import git_revision
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.geofence import check_starts
from fulmar_core.tasks import Task, load_task
from training.request import TrainingRequest, job_of
from training.run_folder import SETTINGS_FILE, START_FILE
from training.settings import Ppo, TrainingSettings, load_training_settings, write_training_settings

RECORD_FILE = "continual.json"
REHEARSED = 0.5  # share of the worlds in which learned tasks are rehearsed, see docs/training.md
OF_ONE_TASK = (
    "mirror", "disturbance_inputs", "body_inputs", "fallback_policy", "incremental_actions", "annealing",
    "stop_at_success",
)  # fmt: skip


@dataclass(frozen=True)
class ContinualPlan:
    """Tasks of one robot, to be learned in this order by one network.

    Attributes:
        tasks: Names, the first one first.
        settings: Of every stage.
        rehearsed: Share of the worlds in which a stage repeats the tasks before it [-].
        updates: Of each stage; None: its wall-clock decides.
        time_limit_s: Wall-clock of each stage; the settings' where it has no updates either [s].
        episodes: Of the evaluation of each task in MuJoCo after each stage.
        stages: Records of the stages that are finished.
    """

    robot: str
    tasks: tuple[str, ...]
    seed: int
    settings: TrainingSettings
    out: Path
    rehearsed: float
    updates: int | None
    time_limit_s: float | None
    episodes: int
    command: str
    git_revision: str
    stages: tuple[dict[str, Any], ...] = ()

    @property
    def learner(self) -> Robot:
        """The robot at the control rate of the settings."""
        return self.settings.learner_of(load_robot(self.robot))

    def begin(self) -> None:
        """Write settings and record into the run folder."""
        self.out.mkdir(parents=True, exist_ok=True)
        write_training_settings(self.settings, self.out / SETTINGS_FILE)
        self.write()

    def with_stage(self, stage: dict[str, Any]) -> ContinualPlan:
        """The plan with one more finished stage, which is in the run folder too."""
        done = replace(self, stages=(*self.stages, stage))
        done.write()
        return done

    def write(self) -> None:
        """Write the record, which `continual_plan` resumes from."""
        write_whole({self.out / RECORD_FILE: (json.dumps(self.record, indent=2) + "\n").encode()})

    @property
    def record(self) -> dict[str, Any]:
        """What the run folder says of the training."""
        return {
            "robot": self.robot,
            "tasks": list(self.tasks),
            "seed": self.seed,
            "rehearsed": self.rehearsed,
            "updates": self.updates,
            "time_limit_s": self.time_limit_s,
            "episodes": self.episodes,
            "command": self.command,
            "git_revision": self.git_revision,
            "stages": list(self.stages),
        }


def is_continual(run: Path | None) -> bool:
    """Whether a run folder is of a training that learns one task after another."""
    return run is not None and (run / RECORD_FILE).is_file()


def continual_plan(
    request: TrainingRequest, further: Sequence[str], rehearsed: float | None
) -> ContinualPlan:
    """The plan that a request describes, new or resumed; nothing is written.

    Args:
        request: Options of `fulmar train`; with `resume` of a run folder that `is_continual`.
        further: Tasks after the first one; after those of a resumed run.
        rehearsed: Share of the worlds in which learned tasks are rehearsed; `REHEARSED`, or the run's, by default.

    Raises:
        ConfigError: Options that exclude one another, an unknown or repeated task, or settings for one task alone.
    """
    alone = {
        "--seeds": request.seeds > 1,
        "--wandb": request.wandb,
        "--calibration": request.calibration is not None,
        "--stop-at-success": request.stop_at_success is not None,
    }
    given = [option for option, is_given in alone.items() if is_given]
    if given:
        raise ConfigError(f"--continue-with trains one run of one robot as it is: leave {given[0]} out.")
    plan = _resumed(request, rehearsed) if request.resume else _new(request, rehearsed)
    plan = replace(plan, tasks=(*plan.tasks, *further))
    for task in plan.tasks:
        if plan.tasks.count(task) > 1:
            raise ConfigError(f"--continue-with: '{task}' is learned already. Name each task once.")
        _check_task(plan.learner, load_task(task))
    _check_settings(plan.settings)
    return plan


def _new(request: TrainingRequest, rehearsed: float | None) -> ContinualPlan:
    job = job_of(request)
    return ContinualPlan(
        job.robot, (job.task,), job.seed, job.settings, job.out, REHEARSED if rehearsed is None else rehearsed,
        job.updates, job.time_limit_s, job.episodes, job.command, job.git_revision,
    )  # fmt: skip


def _resumed(request: TrainingRequest, rehearsed: float | None) -> ContinualPlan:
    run = request.resume
    assert run is not None
    if request.robot or request.task or request.settings or request.out or request.control_hz:
        raise ConfigError(
            "--resume goes on with what the run began with; leave ROBOT, TASK, --settings, --out and --control-hz out."
        )
    if (run / START_FILE).is_file():
        raise ConfigError(f"{run}: was trained at one task: begin anew with --continue-with TASK,...")
    try:
        record = json.loads((run / RECORD_FILE).read_text(encoding="utf-8"))
        robot, tasks = load_robot(record["robot"]), tuple(record["tasks"])
        settings = load_training_settings(robot, load_task(tasks[0]), str(run / SETTINGS_FILE))
        limits = (request.updates, request.time_limit_s)
        updates, time_limit_s = limits if any(limits) else (record["updates"], record["time_limit_s"])
        return ContinualPlan(
            robot.name, tasks, record["seed"], settings, run,
            record["rehearsed"] if rehearsed is None else rehearsed,
            updates, time_limit_s, record["episodes"], request.command, git_revision(),
            tuple(record["stages"]),
        )  # fmt: skip
    except (OSError, ValueError, TypeError, LookupError) as error:
        raise ConfigError(
            f"{run / RECORD_FILE}: is no record of a training task after task ({type(error).__name__}). Begin again "
            "in another folder."
        ) from error


def _check_task(robot: Robot, task: Task) -> None:
    task.check(robot)
    check_starts(robot, task)
    check_starts(robot, task, training=True)


def _check_settings(settings: TrainingSettings) -> None:
    algorithm = settings.algorithm
    if not isinstance(algorithm, Ppo) or algorithm.cloning_updates:
        raise ConfigError(
            "--continue-with learns by ppo without 'cloning_updates'. Give --settings such a file."
        )
    single = [name for name in OF_ONE_TASK if getattr(settings, name)]
    if single:
        raise ConfigError(
            f"--continue-with: the settings have '{single[0]}', which is for one task alone. Give --settings a file "
            "without it, such as thrusters."
        )
