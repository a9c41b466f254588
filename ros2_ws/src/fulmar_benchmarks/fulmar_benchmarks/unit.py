"""One unit of work of a benchmark: run a pair in one way, evaluate it, keep what tables and plots need."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fulmar_benchmarks.results import QUANTILES, PairResult, cached_bound
from fulmar_core.simulation.episode import Episode, episode_steps
from fulmar_core.simulation.metrics import Trajectories, counts_targets, first_steps
from fulmar_core.states.planar import wrapped
from fulmar_evaluation.evaluation import Progress, Tally, Trial, runs_of
from fulmar_evaluation.waypoint_score import bound_figures, has_bound

if TYPE_CHECKING:
    from fulmar_evaluation.ros_evaluation import RosPool

KEPT = 48  # episodes whose paths are kept
CONTROL_HZ = 10.0  # of the environments of RoboRAN (facts §2.1)
GOAL_STEPS = 1000  # horizon of its go_through_positions
FEW_WORLDS = 64  # of the second run in batch, which must give the same numbers
COMPARED = 256  # episodes of that second run
# How long one step takes, in steps of a batch; for the progress bar.
STEP_COSTS = {"batch": 1.0, "mujoco": 120.0, "ros": 600.0}


class Extra:
    """Gathers nothing; others have more arrays to keep of some runs, and more figures."""

    def add(self, run: Trajectories) -> None:
        """Take note of some more episodes, all their steps."""

    def arrays(self) -> dict[str, np.ndarray]:
        """What to keep, by name."""
        return {}

    def figures(self) -> dict[str, np.ndarray]:
        """Further figures of all episodes so far, shapes (episodes,)."""
        return {}


@dataclass(frozen=True)
class Unit:
    """A trial, and where its outcome is kept."""

    trial: Trial
    defines: str  # hash of whatever else the outcome depends on: code, configuration, controller
    folder: Path

    def extra(self) -> Extra:
        """What is gathered beside what every benchmark keeps."""
        return Extra()

    def map_place(self, drawn: Episode) -> np.ndarray:
        """Where each episode lies in the map of successes, shape (episodes, 2)."""
        return _map_place(drawn, self.trial)

    @property
    def name(self) -> str:
        """File name without suffix."""
        plan = self.trial.plan
        return f"{plan.robot}_{plan.task}_{plan.controller}_{self.trial.through}"

    @property
    def key(self) -> str:
        """Hash of everything that the outcome depends on; not of where it runs."""
        trial = self.trial
        plan = asdict(replace(trial.plan, policy=""))
        parts = {"plan": plan, "through": trial.through, "episodes": trial.episodes, "defines": self.defines}
        return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()

    @property
    def path(self) -> Path:
        """File of the outcome."""
        return self.folder / f"{self.name}.npz"

    @property
    def cost(self) -> float:
        """How long it takes, in steps of a batch."""
        steps = self.trial.episodes * episode_steps(_long(self.trial).task, _control_dt(self.trial))
        return steps * STEP_COSTS[self.trial.through]

    def done_before(self) -> PairResult | None:
        """The outcome of an earlier run with the same key, if there is one."""
        try:
            result = PairResult.load(self.path)
        except (OSError, ValueError, KeyError):
            return None
        return result if result.about.get("key") == self.key else None


def done_already(units: Iterable[Unit], *, fresh: bool) -> dict[Unit, PairResult]:
    """What is known of some units from earlier runs."""
    known = {}
    for unit in units:
        if not fresh and (before := unit.done_before()) is not None:
            known[unit] = before
    return known


def run_unit(
    unit: Unit, progress: Progress = lambda steps: None, *, pool: RosPool | None = None
) -> PairResult:
    """Run and evaluate a unit, and keep the outcome in its file.

    Args:
        unit: What to do.
        progress: Called with how many steps have been done, of `cost`.
        pool: Processes that stay for one unit after another, through ros.
    """
    began = time.monotonic()
    trial, weight = _long(unit.trial), STEP_COSTS[unit.trial.through]
    short = unit.trial.task
    steps = episode_steps(short, _control_dt(trial))
    tally, errors, kept, extra = Tally(short), [], _Kept(), unit.extra()
    goals: list[np.ndarray] = []
    for run in runs_of(trial, lambda done: progress(int(weight * done)), pool=pool):
        beginning = first_steps(run, steps)
        tally.add(beginning)
        errors.append(_main_column(run, short))
        kept.add(beginning)
        extra.add(beginning)
        goals.append(run.goals)
    drawn = trial.drawn(np.arange(trial.episodes))
    figures, about = tally.figures | extra.figures(), _about(unit, tally.steps)
    if counts_targets(short):
        _count_goals(trial, drawn, np.concatenate(goals), figures, about, unit.folder)
    if trial.through == "batch":
        about["same_at_64_worlds"], about["compared_episodes"] = _same_with_few_worlds(unit.trial, figures)
    about["wall_s"] = time.monotonic() - began
    sample = drawn[slice(0, KEPT)]  # type: ignore[index]
    where = sample.start.logged()
    outcome = PairResult(
        about=about,
        succeeded=tally.succeeded,
        figures=figures,
        map_xy=unit.map_place(drawn).astype(np.float32),
        over_time=np.quantile(np.concatenate(errors), QUANTILES, axis=0).astype(np.float32),
        paths=kept.paths,
        starts=np.stack([where[name] for name in ("x", "y", "yaw")], axis=-1),
        targets=np.asarray(sample.goal.targets),
        goals=kept.goals,
        obstacles=np.asarray(sample.goal.obstacles)[..., :3],
        more=extra.arrays(),
    )
    outcome.save(unit.path)
    return outcome


class _Kept:
    """The first episodes of some runs."""

    def __init__(self) -> None:
        self._runs: list[Trajectories] = []
        self._count = 0

    def add(self, run: Trajectories) -> None:
        if self._count < KEPT:
            self._runs.append(run)
            self._count += len(run.x)

    @property
    def paths(self) -> np.ndarray:
        pieces = [np.stack((run.x, run.y, run.yaw), axis=-1) for run in self._runs]
        return np.concatenate(pieces)[:KEPT]

    @property
    def goals(self) -> np.ndarray:
        return np.concatenate([run.goals for run in self._runs])[:KEPT]


def _control_dt(trial: Trial) -> float:
    robot = trial.robot
    return robot.timing.substeps(trial.plan.control_hz) * robot.timing.physics_dt


def _long(trial: Trial) -> Trial:
    """The same trial, in the batch as long as the thesis counts waypoints for, where that is longer."""
    task = trial.task
    if trial.through != "batch" or not counts_targets(task):
        return trial
    seconds = max(task.episode_s, GOAL_STEPS * max(_control_dt(trial), 1.0 / CONTROL_HZ))
    return replace(trial, plan=replace(trial.plan, duration_s=seconds))


def _main_column(run: Trajectories, task: object) -> np.ndarray:
    """What is drawn over time: the distance, the velocity error, or the goals reached."""
    if counts_targets(task):  # type: ignore[arg-type]
        return run.goals
    return run.position_error if np.isfinite(run.position_error[0, 0]) else run.velocity_error


def _about(unit: Unit, steps: int) -> dict[str, object]:
    trial = unit.trial
    return {
        "key": unit.key,
        "robot": trial.plan.robot,
        "task": trial.plan.task,
        "controller": trial.plan.controller,
        "through": trial.through,
        "scenario": trial.plan.scenario,
        "goals": trial.plan.goals,
        "seed": trial.plan.seed,
        "control_hz": trial.plan.control_hz,
        "control_dt": _control_dt(trial),
        "episode_s": trial.task.episode_s,
        "control_steps": steps,
    }


def _count_goals(
    trial: Trial,
    drawn: Episode,
    goals: np.ndarray,
    figures: dict[str, np.ndarray],
    about: dict[str, object],
    folder: Path,
) -> None:
    """Add the bound over an episode, and goals over the thesis' horizon: its steps, and its seconds at 10 Hz."""
    dt, known = _control_dt(trial), goals.shape[1]
    for name, steps in (
        ("goals_in_1000_steps", GOAL_STEPS),
        ("goals_in_100_s", round(GOAL_STEPS / CONTROL_HZ / dt)),
    ):
        if steps <= known:
            figures[name] = goals[:, steps - 1]
    about["thousand_steps_s"] = GOAL_STEPS * dt
    if has_bound(trial.task):
        bound = cached_bound(trial, drawn, float(str(about["episode_s"])), folder)
        figures |= bound_figures(figures["goals_reached"], bound)
        about["bound"] = bound.rule


def _same_with_few_worlds(trial: Trial, figures: dict[str, np.ndarray]) -> tuple[bool, int]:
    """Whether the first episodes give the same numbers in small batches, bit for bit."""
    count = min(COMPARED, trial.episodes)
    tally = Tally(trial.task)
    for run in runs_of(replace(trial, episodes=count, worlds=FEW_WORLDS)):
        tally.add(run)
    again = tally.figures
    same = all(
        np.array_equal(values, figures[name][:count], equal_nan=True) for name, values in again.items()
    )
    return same, count


def _map_place(drawn: Episode, trial: Trial) -> np.ndarray:
    """Where each episode lies in the map of successes, shape (episodes, 2)."""
    start, targets = drawn.start, np.asarray(drawn.goal.targets)
    task = trial.task
    if counts_targets(task):
        legs = np.roll(targets[..., :2], -1, axis=1) - targets[..., :2]
        bearing = np.arctan2(legs[..., 1], legs[..., 0])
        turn = np.abs(wrapped(np.roll(bearing, -1, axis=1) - bearing))
        return np.stack(
            (np.mean(np.linalg.norm(legs, axis=-1), axis=1), np.rad2deg(np.mean(turn, axis=1))), -1
        )
    if task.goal_topic == "goal_velocity":
        return np.stack((targets[:, -1, 0], np.rad2deg(targets[:, -1, 2])), axis=-1)
    dx, dy = targets[:, 0, 0] - start.x, targets[:, 0, 1] - start.y
    bearing = wrapped(np.arctan2(dy, dx) - start.yaw)
    return np.stack((np.hypot(dx, dy), np.rad2deg(bearing)), axis=-1)


def map_axes(task: str) -> tuple[str, str]:
    """What the two axes of the map of successes are."""
    if task == "track_velocities":
        return "wanted speed ahead [m/s]", "wanted turn rate [°/s]"
    if task.startswith("go_through") or task.startswith("race"):
        return "mean way between waypoints [m]", "mean turn at waypoints [°]"
    return "distance at the start [m]", "goal's bearing at the start [°]"
