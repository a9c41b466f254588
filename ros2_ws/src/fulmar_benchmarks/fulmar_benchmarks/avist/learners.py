"""Learners side by side on one task, at equal samples and at equal processor time, as thesis Fig. 6.2."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from fulmar_benchmarks.shape import Cell, Figures, Found, Progress
from fulmar_benchmarks.tables import Entry, Row, Table, display_name, number
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario

LEARNERS = ("ppo", "td3", "sac", "dreamer")
CLOSED = "closed_valves"  # doing nothing, which is worth a good part of what learning is
DEVIATIONS = 2.0  # standard deviations over seeds that a learner must be above closed valves
EPISODES, POINTS = 64, 8
LEARNS_S = 10.0  # processor time of learning between two checks, at least, as a check takes a few seconds [s]
HEADS = ("return", "± std", "closed", "success", "samples", "gradient steps", "cpu s", "")
BUDGETS = {"equal_cpu_time": "equal processor time", "equal_samples": "equal samples"}


@dataclass(frozen=True, kw_only=True)
class LearnerCell(Cell):
    """One learner with one seed, or closed valves."""

    modules: ClassVar[tuple[str, ...]] = ("training.learner_runs", "training.dreamer_learning")
    robot: str
    task: str
    learner: str
    seed: int
    samples: int
    cpu_s: float

    def parts(self) -> dict[str, Any]:
        """With its settings, which no other package's hash has."""
        from training.settings import load_training_settings

        if self.learner == CLOSED:
            return super().parts()
        robot, task = load_robot(self.robot), load_task(self.task)
        settings = load_training_settings(robot, task, None if self.learner == "ppo" else self.learner)
        return {**super().parts(), "settings": asdict(settings)}

    def measure(self, progress: Progress, pool: Any = None) -> Figures:
        """Points of its curve."""
        from training.learner_curve import Budget, ClosedValves, worth
        from training.learner_runs import SCENARIO, run_learner

        if self.learner == CLOSED:
            robot, task = load_robot(self.robot), load_task(self.task)
            nothing = ClosedValves(robot)
            value, success = worth(nothing, robot, task, load_scenario(SCENARIO), episodes=EPISODES)
            return {"points": [{"returns": value, "success_rate": success}]}
        count = max(2, min(POINTS, round(self.cpu_s / LEARNS_S)))
        budget = Budget(self.samples, self.cpu_s, count, EPISODES)
        with tempfile.TemporaryDirectory() as folder:
            points = run_learner(
                self.learner, self.robot, self.task, seed=self.seed, budget=budget, out=Path(folder)
            )
        return {"points": points}


def cells_of(
    robot: str, task: str, learners: Iterable[str], *, seeds: int, samples: int, cpu_s: float
) -> list[LearnerCell]:
    """Closed valves, and each learner with each seed from 1 on."""
    shared: dict[str, Any] = {
        "robot": robot,
        "task": task,
        "samples": samples,
        "cpu_s": cpu_s,
        "way": "training",
    }
    closed = LearnerCell(name=f"{task}_{CLOSED}", learner=CLOSED, seed=0, **shared)
    return [closed] + [
        LearnerCell(
            name=f"{task}_{learner}_{seed}", title=f"{learner}, seed {seed}", learner=learner, seed=seed, cost=cpu_s,
            **shared,
        )
        for learner in learners
        for seed in range(1, seeds + 1)
    ]  # fmt: skip


def document_of(cells: Sequence[LearnerCell], found: Found) -> dict[str, Any]:
    """Figures by learner: those at equal processor time, and under `equal_samples` the others.

    `learned` says whether the mean return over seeds is two standard deviations over seeds above that of closed valves;
    null with one seed. A learner that could not run has a `reason` in place of figures.
    """
    closed = _closed(cells, found)
    return {
        learner: _entry([cell for cell in cells if cell.learner == learner], found, closed)
        for learner in dict.fromkeys(cell.learner for cell in cells if cell.learner != CLOSED)
    }


def _closed(cells: Sequence[LearnerCell], found: Found) -> float | None:
    figures = next(found[cell.name] for cell in cells if cell.learner == CLOSED)
    return None if isinstance(figures, str) else float(figures["points"][0]["returns"])


def _entry(cells: Sequence[LearnerCell], found: Found, closed: float | None) -> dict[str, Any]:
    every = [found[cell.name] for cell in cells]
    reason = next((each for each in every if isinstance(each, str)), None)
    curves = [[dict(point) for point in each["points"]] for each in every if not isinstance(each, str)]
    if not curves or closed is None:
        return {"reason": reason or "closed valves could not be evaluated"}
    timed, few = (
        _at([min(curve, key=lambda one: abs(one[budget] - limit)) for curve in curves], closed)
        for budget, limit in (("cpu_s", cells[0].cpu_s), ("samples", cells[0].samples))
    )
    return {**timed, "equal_samples": few, "curves": curves, "reason": reason}


def _at(points: Sequence[Mapping[str, Any]], closed: float) -> dict[str, Any]:
    """Means over seeds at one moment."""
    means = {key: float(np.mean([point[key] for point in points])) for key in points[0]}
    value = means.pop("returns")
    spread = float(np.std([point["returns"] for point in points], ddof=1)) if len(points) > 1 else None
    learned = None if spread is None else value > closed + DEVIATIONS * spread
    return {
        "return": value, "return_std": spread, "closed_valves": closed, "learned": learned, "seeds": len(points),
        **means,
    }  # fmt: skip


def tables_of(learners: Mapping[str, Mapping[str, Any]], task: str) -> list[Table | str]:
    """A table for each budget, and why a learner is missing."""
    present = {name: each for name, each in learners.items() if "return" in each}
    every = {"equal_cpu_time": present, "equal_samples": {}}
    every["equal_samples"] = {name: each["equal_samples"] for name, each in present.items()}
    tables: list[Table | str] = [
        Table(f"Learners at {display_name(task)}, {BUDGETS[budget]}", ("", *HEADS), _rows(entries), words=1)
        for budget, entries in every.items()
        if entries
    ]
    return tables + [f"{name}: {each['reason']}" for name, each in learners.items() if each["reason"]]


def _rows(entries: Mapping[str, Mapping[str, Any]]) -> list[Row]:
    words = {True: "learned", False: "not learned", None: "one seed"}
    return [
        Row(
            (
                Entry(display_name(name)),
                *(Entry(number(each[key], digits)) for key, digits in _SHOWN),
                Entry(words[each["learned"]]),
            )
        )
        for name, each in entries.items()
    ]


_SHOWN = (
    ("return", 0), ("return_std", 0), ("closed_valves", 0), ("success_rate", 3), ("samples", 0),
    ("gradient_steps", 0), ("cpu_s", 0),
)  # fmt: skip
