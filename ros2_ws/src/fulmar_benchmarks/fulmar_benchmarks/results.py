"""Results of one pair; bounds on waypoints, kept in .npz files."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

import fulmar_evaluation.bounds
from fulmar_benchmarks.shape import Figures
from fulmar_core.config.atomic_write import whole_file
from fulmar_core.simulation.episode import Episode
from fulmar_evaluation.evaluation import Trial
from fulmar_evaluation.waypoint_score import WaypointBound, waypoint_bound

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)  # of what is kept over time


@dataclass(frozen=True)
class PairResult:
    """One robot, task and controller in one way of running."""

    about: dict[str, Any]  # JSON-ready: what was run, and what is said in words
    succeeded: np.ndarray  # (episodes,) truth values
    figures: dict[str, np.ndarray]  # (episodes,) by the names of `fulmar_evaluation.figures`
    map_xy: np.ndarray  # (episodes, 2) where an episode lies in the map of successes
    over_time: np.ndarray  # (quantiles, steps) of the error, or of the goals reached
    paths: np.ndarray  # (kept, steps, 3) x [m], y [m], yaw [rad] of the first episodes
    starts: np.ndarray  # (kept, 3) same, before the first step
    targets: np.ndarray  # (kept, k, 3) as in `Goal`
    goals: np.ndarray  # (kept, steps) targets reached, or over
    obstacles: np.ndarray  # (kept, m, 3) x, y, radius [m]
    more: dict[str, np.ndarray] = field(default_factory=dict)  # whatever else a benchmark keeps

    @property
    def time_s(self) -> np.ndarray:
        """Ends of the control steps of `paths`, shape (steps,) [s]."""
        return float(self.about["control_dt"]) * np.arange(1, self.paths.shape[1] + 1)


Outcome = PairResult | str  # a sentence where it could not be measured


def outcome_of(figures: Figures | str) -> Outcome:
    """What `unit.TrialCell.measure` found."""
    return figures if isinstance(figures, str) else PairResult(**figures)


def statistics(values: np.ndarray) -> dict[str, float | None]:
    """Mean, median, 5th and 95th percentile of what is a number, shape (episodes,)."""
    known = np.asarray(values, dtype=float)
    known = known[np.isfinite(known)]
    if not known.size:
        return {"mean": None, "median": None, "p5": None, "p95": None}
    low, middle, high = (float(value) for value in np.percentile(known, (5, 50, 95)))
    return {"mean": float(np.mean(known)), "median": middle, "p5": low, "p95": high}


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
    except Exception:  # noqa: BLE001 - not there, or torn in whichever way: it is computed and written anew
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
    parts = {
        "robot": asdict(trial.robot),
        "tolerance": asdict(trial.task.tolerance),
        "duration_s": duration_s,
    }
    digest.update(json.dumps(parts, sort_keys=True, default=str).encode())
    for array in (drawn.start.x, drawn.start.y, drawn.start.yaw, drawn.goal.targets):
        digest.update(np.ascontiguousarray(array).tobytes())
    for path in sorted(Path(str(fulmar_evaluation.bounds.__file__)).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
