"""Bounds on waypoints, kept in files: they take minutes, and no controller changes them."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

import fulmar_evaluation.bounds
from fulmar_core.atomic_write import whole_file
from fulmar_core.episode import Episode
from fulmar_evaluation.evaluation import Trial
from fulmar_evaluation.waypoint_score import WaypointBound, waypoint_bound


def cached_bound(trial: Trial, drawn: Episode, duration_s: float, folder: Path) -> WaypointBound:
    """The bound of some episodes, from a file if an earlier run left it there.

    Args:
        trial: Its robot and task are meant.
        drawn: The episodes.
        duration_s: How long they last [s].
        folder: Where files are kept.
    """
    path = folder / f"{trial.plan.robot}_{trial.plan.task}_bound_{_key(trial, drawn, duration_s)}.npz"
    try:
        with np.load(path, allow_pickle=False) as file:
            fastest = file["goals_at_top_speed"] if "goals_at_top_speed" in file.files else None
            return WaypointBound(file["goals"], fastest, str(file["name"]), str(file["rule"]))
    except (OSError, ValueError, KeyError):
        pass
    bound = waypoint_bound(trial.robot, trial.task, drawn, duration_s)
    kept: dict[str, Any] = {"goals": bound.goals, "name": np.array(bound.name), "rule": np.array(bound.rule)}
    if bound.goals_at_top_speed is not None:
        kept["goals_at_top_speed"] = bound.goals_at_top_speed
    folder.mkdir(parents=True, exist_ok=True)
    with whole_file(path) as file:
        np.savez(file, **kept)
    return bound


def _key(trial: Trial, drawn: Episode, duration_s: float) -> str:
    """Hash of everything that a bound depends on: robot, tolerance, places, and the code."""
    digest = hashlib.sha256()
    told = {"robot": asdict(trial.robot), "tolerance": asdict(trial.task.tolerance), "duration_s": duration_s}
    digest.update(json.dumps(told, sort_keys=True, default=str).encode())
    for array in (drawn.start.x, drawn.start.y, drawn.start.yaw, drawn.goal.targets):
        digest.update(np.ascontiguousarray(array).tobytes())
    for path in sorted(Path(str(fulmar_evaluation.bounds.__file__)).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
