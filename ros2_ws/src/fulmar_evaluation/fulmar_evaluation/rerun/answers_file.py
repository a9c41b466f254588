"""What a controller answered to a bag, as a file for other programs."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_bags.control_steps import ControlSteps
from fulmar_core.errors import ConfigError
from fulmar_evaluation.rerun.rerun import Answers

ENDINGS = (".csv", ".npz")


def check_answers_file(path: Path) -> None:
    """Refuse a name that says no format.

    Raises:
        ConfigError: It ends in something else.
    """
    if path.suffix not in ENDINGS:
        raise ConfigError(f"--out {path}: answers are written as .csv or .npz. Give such a name.")


def write_answers(course: ControlSteps, answers: Answers, path: Path) -> None:
    """Write one row for each step: stamp [ns], whether the controller was asked and why not, and its vectors.

    Args:
        course: The run.
        answers: To it.
        path: A `.csv` table with one column for each number, or `.npz` arrays; its folder is made.

    Raises:
        OSError: It cannot be written.
    """
    names = course.robot.actuators.names
    vectors = {
        "observation": (answers.observation_names, answers.observations),
        "action": (names, answers.actions),
        "command": (names, answers.commands),
    }
    told: dict[str, Any] = {
        "stamp_ns": course.stamp_ns,
        "asked": answers.acted,
        "reason": np.array(answers.reasons),
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".npz":
        labels = {f"{field}_names": np.array(names) for field, (names, _) in vectors.items()}
        values = {field: table for field, (_, table) in vectors.items()}
        np.savez_compressed(path, allow_pickle=False, **told, **labels, **values)
        return
    with path.open("w", newline="", encoding="utf-8") as stream:
        table = csv.writer(stream)
        table.writerow(
            [*told, *(f"{field}.{name}" for field, (names, _) in vectors.items() for name in names)]
        )
        tables = np.concatenate([values for _, values in vectors.values()], axis=1)
        for step, row in enumerate(tables.tolist()):
            told_here = (int(course.stamp_ns[step]), int(answers.acted[step]), answers.reasons[step])
            table.writerow([*told_here, *("" if np.isnan(value) else value for value in row)])
