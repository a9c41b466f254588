"""A training by DreamerV3 as a job: the same run folder as any other's."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from fulmar_core.robots.calibration import calibration_path
from fulmar_core.robots.robot import Robot
from fulmar_core.safety.geofence import check_starts
from fulmar_core.tasks import Task
from training.dreamer_process import Learner, dreamer_python
from training.dreamer_request import Request
from training.progress import Watcher
from training.run_folder import CHECKPOINT_FILE, SETTINGS_FILE, write_run_record
from training.session import polite_interrupt
from training.settings import TrainingSettings
from training.train import begin_run


def train_dreamer(
    robot: Robot,
    task: Task,
    settings: TrainingSettings,
    *,
    seed: int,
    out: Path,
    time_limit_s: float | None,
    updates: int | None,
    command: str,
    git_revision: str,
    watcher: Watcher,
) -> dict[str, Any]:
    """Learn as `training.train.train` does, in a process of `.venv-dreamer`.

    Returns:
        The content of `run.json`.

    Raises:
        ConfigError: The environment is missing, or the task or the checkpoint does not fit.
        DreamerError: sheeprl failed.
        KeyboardInterrupt: The user ended it; the run folder is finished with the best network so far.
    """
    python = dreamer_python()
    check_starts(robot, task)
    check_starts(robot, task, training=True)
    limit = time_limit_s
    if limit is None and updates is None:
        limit = settings.time_limit_s
    begin_run(robot, task, settings, seed=seed, out=out, time_limit_s=limit, updates=updates)
    calibration = calibration_path()
    request = Request(
        robot.name, task.name, seed, str((out / SETTINGS_FILE).absolute()), str(out.absolute()),
        time_limit_s=limit, updates=updates, resume=(out / CHECKPOINT_FILE).is_file(),
        calibration=str(calibration.absolute()) if calibration else "",
    )  # fmt: skip

    def take(said: Mapping[str, Any]) -> None:
        if said["kind"] == "advance":
            watcher.advance(said["share"], said["elapsed_s"], said["steps"])
        elif said["kind"] == "evaluated":
            watcher.evaluated(said["elapsed_s"], said["success"])

    with polite_interrupt() as asked, Learner(request, python) as learner:
        watcher.begin()
        try:
            done = learner.listen(take, asked.is_set)
        finally:
            watcher.end()
    del done["kind"]
    record = {
        "robot": robot.name,
        "task": task.name,
        "seed": seed,
        "command": command,
        "git_revision": git_revision,
        "control_hz": robot.timing.control_hz,
        "settings": asdict(settings),
        **done,
    }
    write_run_record(out, record)
    if record["interrupted"]:
        raise KeyboardInterrupt
    return record
