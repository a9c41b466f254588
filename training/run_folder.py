"""Files of a run folder, their readers and writers, and the lock of a training.

settings.yaml   its training settings
start.json      its request: robot, task, seed, limits
run.json        its record; written at the end
network.pt      the best weights, as a robot would run them
checkpoint.pkl  everything a run needs to go on exactly where it was
tensorboard/    curves
calibration.yaml the calibration of the robot, if one was given
fallback_policy/ the run folder of the network that takes over from this one, where it has such
progress.json   its progress, for other processes
learning.lock   held by the process that learns
"""

from __future__ import annotations

import contextlib
import fcntl
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from fulmar_core.config.atomic_write import write_whole
from fulmar_core.config.errors import ConfigError

SETTINGS_FILE = "settings.yaml"
START_FILE = "start.json"
RUN_FILE = "run.json"
NETWORK_FILE = "network.pt"
CHECKPOINT_FILE = "checkpoint.pkl"
TENSORBOARD_FOLDER = "tensorboard"
CALIBRATION_FILE = "calibration.yaml"
PROGRESS_FILE = "progress.json"
FALLBACK_FOLDER = "fallback_policy"

_NEEDED = (
    "robot",
    "task",
    "control_hz",
    "command",
    "seed",
    "steps",
    "wall_s",
    "settings",
    "best",
    "versions",
)


def read_run_record(run: Path) -> dict[str, Any]:
    """The record of a finished run.

    Raises:
        ConfigError: If `run` is no finished run folder.
    """
    path = run / RUN_FILE
    if not path.is_file() or not (run / NETWORK_FILE).is_file():
        raise ConfigError(
            f"{run}: no finished training run ({RUN_FILE} or {NETWORK_FILE} is missing). Run `fulmar train`."
        )
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise ConfigError(f"{path}: not valid JSON: {error}. Train again.") from error
    missing = [key for key in _NEEDED if not isinstance(record, dict) or key not in record]
    if missing:
        raise ConfigError(
            f"{path}: lacks '{missing[0]}', so it is not what `fulmar train` left. Train again."
        )
    return dict(record)


def read_start(run: Path) -> dict[str, Any]:
    """The request of a run: `robot`, `task`, `seed`, `time_limit_s` and `updates`.

    Raises:
        ConfigError: If `run` is no run folder.
    """
    path = run / START_FILE
    try:
        start = dict(json.loads(path.read_text(encoding="utf-8")))
        return {key: start[key] for key in ("robot", "task", "seed", "time_limit_s", "updates")}
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise ConfigError(f"{run}: no training run to resume ({START_FILE} cannot be read).") from error


def write_start(run: Path, start: dict[str, Any]) -> None:
    """Write what `read_start` reads."""
    write_whole({run / START_FILE: (json.dumps(start, indent=2) + "\n").encode()})


def write_run_record(run: Path, record: dict[str, Any]) -> None:
    """Write what `read_run_record` reads."""
    write_whole({run / RUN_FILE: (json.dumps(record, indent=2) + "\n").encode()})


LOCK_FILE = "learning.lock"


@contextlib.contextmanager
def learning_in(run: Path) -> Iterator[None]:
    """Lock a run folder for one training; the lock ends with the context or the process.

    Raises:
        ConfigError: Another process trains there.
    """
    run.mkdir(parents=True, exist_ok=True)
    path = run / LOCK_FILE
    with path.open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise ConfigError(
                f"{run}: another `fulmar train` is learning there. Give --out another folder."
            ) from None
        try:
            yield
        finally:
            path.unlink(missing_ok=True)
