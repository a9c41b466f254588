"""One unit of work of a benchmark: run a pair in one way, evaluate it, keep what tables and plots need."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from fulmar_benchmarks.results import QUANTILES, PairResult, cached_bound
from fulmar_benchmarks.shape import POOL, ROS, Cell, Figures, Progress
from fulmar_core.simulation.episode import Episode, episode_steps
from fulmar_core.simulation.metrics import Trajectories, counts_targets, first_steps
from fulmar_core.states.planar import wrapped
from fulmar_evaluation.evaluation import Tally, Trial, runs_of
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


@dataclass(frozen=True, kw_only=True)
class TrialCell(Cell):
    """A trial of a pair: run it in one way, evaluate it, keep what tables and plots need."""

    modules: ClassVar[tuple[str, ...]] = ("fulmar_benchmarks.results",)
    trial: Trial
    defines: str  # hash of the controller
    bounds: Path  # folder of bounds, which several cells share

    def parts(self) -> dict[str, Any]:
        """Not where the policy lies, nor how many processes there are."""
        trial = self.trial
        plan = asdict(replace(trial.plan, policy=""))
        return {"plan": plan, "through": trial.through, "episodes": trial.episodes, "defines": self.defines}

    def extra(self) -> Extra:
        """What is gathered beside what every benchmark keeps."""
        return Extra()

    def map_place(self, drawn: Episode) -> np.ndarray:
        """Where each episode lies in the map of successes, shape (episodes, 2)."""
        return _map_place(drawn, self.trial)

    def measure(self, progress: Progress, pool: RosPool | None = None) -> Figures:
        """Fields of a `PairResult`."""
        return dict(vars(self.result(progress, pool)))

    def result(self, progress: Progress = lambda steps: None, pool: RosPool | None = None) -> PairResult:
        """Run it and evaluate it."""
        began = time.monotonic()
        trial, weight = _long(self.trial), STEP_COSTS[self.trial.through]
        short = self.trial.task
        steps = episode_steps(short, _control_dt(trial))
        tally, errors, kept, extra = Tally(short, trial.robot), [], _Kept(), self.extra()
        goals: list[np.ndarray] = []
        for run in runs_of(trial, lambda done: progress(weight * done), pool=pool):
            beginning = first_steps(run, steps)
            tally.add(beginning)
            errors.append(_main_column(run, short))
            kept.add(beginning)
            extra.add(beginning)
            goals.append(run.goals)
        drawn = trial.drawn(np.arange(trial.episodes))
        figures, about = tally.figures | extra.figures(), _about(self.trial, tally.steps)
        if counts_targets(short):
            _count_goals(trial, drawn, np.concatenate(goals), figures, about, self.bounds)
        if trial.through == "batch":
            about["same_at_64_worlds"], about["compared_episodes"] = _same_with_few_worlds(
                self.trial, figures
            )
        about["wall_s"] = time.monotonic() - began
        sample = drawn[slice(0, KEPT)]  # type: ignore[index]
        where = sample.start.logged()
        return PairResult(
            about=about,
            succeeded=tally.succeeded,
            figures=figures,
            map_xy=self.map_place(drawn).astype(np.float32),
            over_time=np.quantile(np.concatenate(errors), QUANTILES, axis=0).astype(np.float32),
            paths=kept.paths,
            starts=np.stack([where[name] for name in ("x", "y", "yaw")], axis=-1),
            targets=np.asarray(sample.goal.targets),
            goals=kept.goals,
            obstacles=np.asarray(sample.goal.obstacles)[..., :3],
            more=extra.arrays(),
        )


def costs(trial: Trial) -> float:
    """How long a trial takes, in steps of a batch."""
    steps = trial.episodes * episode_steps(_long(trial).task, _control_dt(trial))
    return steps * STEP_COSTS[trial.through]


def where_of(trial: Trial) -> str:
    """Trials through ros are on nodes that use all cores themselves."""
    return ROS if trial.through == "ros" else POOL


def said_of(cell: Cell, figures: Figures, main: str) -> str:
    """Main figure of a trial, and how fast it went."""
    about = figures["about"]
    return f"{main}, {about['wall_s']:.1f} s, {about['control_steps'] / about['wall_s']:,.0f} steps/s"


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


def _about(trial: Trial, steps: int) -> dict[str, object]:
    return {
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
    tally = Tally(trial.task, trial.robot)
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
