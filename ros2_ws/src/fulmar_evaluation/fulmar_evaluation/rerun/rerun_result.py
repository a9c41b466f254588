"""Differences between a recorded run and a controller's answers to it, and the answers as a file."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_bags.comparison import Field, compare
from fulmar_bags.control_steps import ControlSteps
from fulmar_core.config.errors import ConfigError
from fulmar_core.safety.envelope.event import Event
from fulmar_evaluation.rerun.rerun import Answers

FIELDS = ("decision", "observation", "action", "command")
NUMBER = re.compile(r"-?[0-9]+([.][0-9]+)?")


def compare_answers(record: ControlSteps, answers: Answers, tolerances: Mapping[str, float]) -> list[Field]:
    """Compare every field that the bag has.

    Returns:
        `decision` (1: the controller was asked), `observation`, `action` (before limits) and `command` (after them), as
        far as they were recorded.
    """
    actuators = record.robot.actuators.names
    kept = ~_lost(record)  # what the record has lost, cannot be compared
    parts: list[tuple[str, Sequence[str], np.ndarray, np.ndarray]] = []
    if record.own:
        parts.append(("decision", ("acted",), record.acted[:, None], answers.acted[:, None]))
    if record.observation_names == answers.observation_names:
        parts.append(("observation", record.observation_names, record.observations, answers.observations))
    if np.isfinite(record.actions).any():
        parts.append(("action", actuators, record.actions, answers.actions))
    if np.isfinite(record.commands).any():
        there = np.isnan(record.commands)
        parts.append(("command", actuators, record.commands, np.where(there, np.nan, answers.commands)))
    return [
        line
        for field, names, recorded, found in parts
        for line in compare(
            field,
            names,
            recorded.astype(float),
            found.astype(float) if field == "command" else np.where(kept[:, None], found, recorded),
            record.stamp_ns,
            tolerances[field],
        )
    ]


def compare_trips(recorded: Sequence[Event], answers: Answers) -> dict[str, Any] | None:
    """Compare trips and returns of the envelope guard, to the bit.

    Returns:
        How many there are in both, and whether they are the same; None where neither had any.
    """
    if answers.trips is None or not (recorded or answers.trips):
        return None
    return {
        "recorded": len(recorded),
        "found": len(answers.trips),
        "same": tuple(recorded) == _as_recorded(recorded, answers.trips),
    }


def _as_recorded(recorded: Sequence[Event], found: Sequence[Event]) -> tuple[Event, ...]:
    """Events without their sides where the bag is older than these."""
    known = any(event.side for event in recorded)
    return tuple(found) if known else tuple(replace(event, side="") for event in found)


def _lost(record: ControlSteps) -> np.ndarray:
    """Steps whose observation is not in the bag, though a command that is not the safe one shows that there was one."""
    driven = np.isfinite(record.commands).all(axis=1) & (
        record.commands != record.robot.actuators.safe_command
    ).any(axis=1)
    return ~record.acted & driven


@dataclass(frozen=True)
class Pause:
    """Steps at which the controller was not asked, for one reason."""

    reason: str  # as it was first given; numbers in it change from step to step
    steps: int
    first_step: int


def pauses(answers: Answers) -> list[Pause]:
    """Why the controller was not asked, the most frequent reason first."""
    steps: dict[str, list[int]] = {}
    for step, reason in enumerate(answers.reasons):
        if reason:
            steps.setdefault(NUMBER.sub("#", reason), []).append(step)
    found = [Pause(answers.reasons[each[0]], len(each), each[0]) for each in steps.values()]
    return sorted(found, key=lambda pause: -pause.steps)


@dataclass(frozen=True)
class Sums:
    """What came of one kind of vector, over all its entries."""

    field: str
    steps: int
    differing: int  # numbers that differ
    largest: float  # difference


def sums(fields: Sequence[Field]) -> list[Sums]:
    """One line for each kind of vector."""
    kinds = dict.fromkeys(each.field for each in fields)
    return [
        Sums(
            kind,
            max(each.compared for each in fields if each.field == kind),
            sum(each.differing for each in fields if each.field == kind),
            max(each.difference["max"] if each.difference else 0.0 for each in fields if each.field == kind),
        )
        for kind in kinds
    ]


ENDINGS = (".csv", ".npz")


def check_answers_file(path: Path) -> None:
    """Refuse a name that says no format.

    Raises:
        ConfigError: It ends in something else.
    """
    if path.suffix not in ENDINGS:
        raise ConfigError(f"--out {path}: answers are written as .csv or .npz. Give such a name.")


def write_answers(record: ControlSteps, answers: Answers, path: Path) -> None:
    """Write one row for each step: stamp [ns], whether the controller was asked and why not, and its vectors.

    Args:
        record: The run.
        answers: To it.
        path: A `.csv` table with one column for each number, or `.npz` arrays; its folder is made.

    Raises:
        OSError: It cannot be written.
    """
    names = record.robot.actuators.names
    vectors = {
        "observation": (answers.observation_names, answers.observations),
        "action": (names, answers.actions),
        "command": (names, answers.commands),
    }
    columns: dict[str, Any] = {
        "stamp_ns": record.stamp_ns,
        "asked": answers.acted,
        "reason": np.array(answers.reasons),
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".npz":
        labels = {f"{field}_names": np.array(names) for field, (names, _) in vectors.items()}
        values = {field: table for field, (_, table) in vectors.items()}
        np.savez_compressed(path, allow_pickle=False, **columns, **labels, **values)
        return
    with path.open("w", newline="", encoding="utf-8") as stream:
        table = csv.writer(stream)
        table.writerow(
            [*columns, *(f"{field}.{name}" for field, (names, _) in vectors.items() for name in names)]
        )
        tables = np.concatenate([values for _, values in vectors.values()], axis=1)
        for step, row in enumerate(tables.tolist()):
            first_columns = (int(record.stamp_ns[step]), int(answers.acted[step]), answers.reasons[step])
            table.writerow([*first_columns, *("" if np.isnan(value) else value for value in row)])
