"""Plan of a training that learns one task after another, and its record in the run folder."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from fulmar_core.config.atomic_write import write_whole
from fulmar_core.config.errors import ConfigError
from fulmar_core.config.provenance import git_revision
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.geofence import check_starts
from fulmar_core.tasks import load_task
from training.request import TrainingRequest, job_of
from training.run_folder import SETTINGS_FILE, START_FILE
from training.settings import Ppo, Sac, StopAtSuccess, Td3, TrainingSettings, load_training_settings

RECORD_FILE = "continual.json"
ALONE_FOLDER = "alone"  # trainings at each task
# Settings of networks that are more than layers over a task's own observation terms.
ALONE = ("mirror", "disturbance_inputs", "body_inputs", "fallback_policy", "incremental_actions")


@dataclass(frozen=True)
class ContinualPlan:
    """Tasks of one robot, to be learned in this order.

    Attributes:
        tasks: Names, the first one first.
        settings: A file of training settings for all tasks; None: those of robot and task.
        control_hz: Command rate; None: the settings' [Hz].
        stop_at_success: Success at which a training ends early; None: the settings' [-].
        updates: Of the training at each task; None: its wall-clock decides.
        time_limit_s: Wall-clock of the training at each task; None: the settings' [s].
        episodes: Of the evaluation of each task in MuJoCo after each stage.
        stages: Records of the stages that are finished.
    """

    robot: str
    tasks: tuple[str, ...]
    seed: int
    settings: str | None
    control_hz: float | None
    stop_at_success: float | None
    updates: int | None
    time_limit_s: float | None
    episodes: int
    out: Path
    command: str
    git_revision: str
    stages: tuple[dict[str, Any], ...] = ()

    def settings_of(self, task: str) -> TrainingSettings:
        """Training settings of a task; those that its training began with, once it has begun.

        Raises:
            ConfigError: As in `load_training_settings`.
        """
        begun = self.out / ALONE_FOLDER / task / SETTINGS_FILE
        name = str(begun) if begun.is_file() else self.settings
        found = load_training_settings(load_robot(self.robot), load_task(task), name)
        if self.control_hz is not None:
            found = replace(found, control_hz=self.control_hz)
        if self.stop_at_success is not None:
            found = replace(found, stop_at_success=StopAtSuccess(self.stop_at_success))
        return found

    @property
    def learner(self) -> Robot:
        """The robot at the command rate of the settings."""
        return self.settings_of(self.tasks[0]).learner_of(load_robot(self.robot))

    def with_stage(self, stage: dict[str, Any]) -> ContinualPlan:
        """The plan with one more finished stage, which is in the run folder too."""
        done = replace(self, stages=(*self.stages, stage))
        done.write()
        return done

    def write(self) -> None:
        """Write the record, which `continual_plan` resumes from."""
        self.out.mkdir(parents=True, exist_ok=True)
        write_whole({self.out / RECORD_FILE: (json.dumps(self.record, indent=2) + "\n").encode()})

    @property
    def record(self) -> dict[str, Any]:
        """What the run folder says of the training."""
        return {name: value for name, value in asdict(self).items() if name != "out"}


def is_continual(run: Path | None) -> bool:
    """Whether a run folder is of a training that learns one task after another."""
    return run is not None and (run / RECORD_FILE).is_file()


def continual_plan(request: TrainingRequest, further: Sequence[str]) -> ContinualPlan:
    """The plan that a request describes, new or resumed; nothing is written.

    Args:
        request: Options of `fulmar train`; with `resume` of a run folder that `is_continual`.
        further: Tasks after the first one; after those of a resumed run.

    Raises:
        ConfigError: Options that exclude one another, an unknown or repeated task, or settings of one task alone.
    """
    alone = {
        "--seeds": request.seeds > 1,
        "--wandb": request.wandb,
        "--calibration": request.calibration is not None,
        "--ray": request.executor == "ray" or request.address is not None,
    }
    given = [option for option, is_given in alone.items() if is_given]
    if given:
        raise ConfigError(f"--continue-with trains one run of one robot as it is: leave {given[0]} out.")
    plan = _resumed(request, request.resume) if request.resume else _new(request)
    plan = replace(plan, tasks=(*plan.tasks, *further))
    for task in plan.tasks:
        if plan.tasks.count(task) > 1:
            raise ConfigError(f"--continue-with: '{task}' is learned already. Name each task once.")
        load_task(task).check(load_robot(plan.robot))
        _check_settings(plan, task)
        for training in (False, True):
            check_starts(plan.learner, load_task(task), training=training)
    return plan


def _new(request: TrainingRequest) -> ContinualPlan:
    job = job_of(request)
    return ContinualPlan(
        job.robot, (job.task,), job.seed, request.settings, request.control_hz, request.stop_at_success,
        job.updates, job.time_limit_s, job.episodes, job.out, job.command, job.git_revision,
    )  # fmt: skip


def _resumed(request: TrainingRequest, run: Path) -> ContinualPlan:
    if (
        request.robot
        or request.task
        or request.seed != 1
        or request.settings
        or request.out
        or request.control_hz
    ):
        raise ConfigError(
            "--resume goes on with what the run began with; leave ROBOT, TASK, --seed, --settings, --out and "
            "--control-hz out."
        )
    if (run / START_FILE).is_file():
        raise ConfigError(f"{run}: was trained at one task: begin anew with --continue-with TASK,...")
    try:
        record = json.loads((run / RECORD_FILE).read_text(encoding="utf-8"))
        plan = ContinualPlan(out=run, **record | {name: tuple(record[name]) for name in ("tasks", "stages")})
    except (OSError, ValueError, TypeError, LookupError) as error:
        raise ConfigError(
            f"{run / RECORD_FILE}: is no record of a training task after task ({type(error).__name__}). Begin again "
            "in another folder."
        ) from error
    if request.updates is not None or request.time_limit_s is not None:
        plan = replace(plan, updates=request.updates, time_limit_s=request.time_limit_s)
    stop = request.stop_at_success if request.stop_at_success is not None else plan.stop_at_success
    made = {"command": request.command, "git_revision": git_revision()}
    return replace(plan, stop_at_success=stop, episodes=request.episodes, **made)


def _check_settings(plan: ContinualPlan, task: str) -> None:
    """Reject settings whose network cannot share its layers with that of the first task."""
    first, settings = plan.settings_of(plan.tasks[0]), plan.settings_of(task)
    if not isinstance(settings.algorithm, Ppo | Sac | Td3):
        raise ConfigError(
            f"--continue-with learns by ppo, sac or td3, not by {settings.algorithm.kind}. Give --settings such a file."
        )
    alone = [name for name in ALONE if getattr(settings, name)]
    if alone:
        raise ConfigError(
            f"--continue-with: the settings of '{task}' have '{alone[0]}', which is for one task alone. Give "
            "--settings a file without it for all tasks, such as thrusters."
        )
    for key in ("action_space", "control_hz"):
        if getattr(first, key) != getattr(settings, key):
            raise ConfigError(
                f"--continue-with: the settings of '{task}' and '{plan.tasks[0]}' differ in '{key}'. Give --settings "
                "one file for all tasks."
            )
    if isinstance(first.algorithm, Ppo) is not isinstance(settings.algorithm, Ppo):
        raise ConfigError(
            "--continue-with: the tasks' algorithms differ. Give --settings one file for all tasks."
        )
