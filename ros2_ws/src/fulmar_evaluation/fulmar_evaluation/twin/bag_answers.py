"""What the old and the new bundle answer to the recorded bags."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from fulmar_bags.bag_reading import BagReading
from fulmar_bags.contents import open_bag
from fulmar_core.config.errors import FulmarError
from fulmar_evaluation.rerun.rerun_bag import RerunRequest, rerun_bag
from fulmar_evaluation.rerun.rerun_result import FIELDS

EXACT = dict.fromkeys(FIELDS, 0.0)


@dataclass(frozen=True)
class _Answered:
    commands: np.ndarray  # (n, m)
    asked: np.ndarray  # (n,)
    result: dict[str, Any]


def bag_answers(
    bags: Sequence[Path], old: Path, new: Path, *, task: str, reading: BagReading
) -> list[dict[str, Any]]:
    """Re-run each bag with both bundles, by the recorded odometry and goals, through the guarded loop.

    Args:
        bags: The bags.
        old: Bundle in use.
        new: Bundle that was trained.
        task: Task of both.
        reading: What the bags do not say themselves.

    Returns:
        A line for each bag: `bag`, `steps`, `asked` (steps that the new bundle answered), `differing` (share of these
        with another command than the old bundle's); or `bag` and `skipped`, with the reason, as for the bag of another
        task.
    """
    return [_one(bag, old, new, task=task, reading=reading) for bag in bags]


def _one(bag: Path, old: Path, new: Path, *, task: str, reading: BagReading) -> dict[str, Any]:
    try:
        before, after = (_answers(bag, folder, task, reading) for folder in (old, new))
    except FulmarError as error:
        return {"bag": str(bag), "skipped": str(error)}
    asked = before.asked & after.asked
    other = np.any(before.commands != after.commands, axis=1)
    return {
        "bag": str(bag),
        "steps": len(asked),
        "asked": int(after.asked.sum()),
        "differing": float(np.mean(other[asked])) if asked.any() else None,
        "recorded_with_old": before.result["sha256"] in before.result["recorded_sha256s"],
    }


def _answers(bag: Path, policy: Path, task: str, reading: BagReading) -> _Answered:
    opened = open_bag(bag, reading)
    with TemporaryDirectory(prefix="fulmar_twin_") as scratch:
        out = Path(scratch) / "answers.npz"
        request = RerunRequest(
            "policy", policy, "odometry", "direct", reading.robot, task, None, None, None, out
        )
        result = rerun_bag(opened, request, EXACT, lambda lines: None)
        with np.load(out, allow_pickle=False) as found:
            return _Answered(found["command"], found["asked"].astype(bool), result)
