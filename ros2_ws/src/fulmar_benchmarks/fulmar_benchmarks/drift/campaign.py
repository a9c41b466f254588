"""The benchmark after thesis Tables 3.5 and 3.6: every controller in every row, one document."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from fulmar_benchmarks.drift.cells import STYLE, conclusion, shown
from fulmar_benchmarks.drift.conditions import (
    CONDITIONS,
    PATH_EPISODE_S,
    PATH_EPISODES,
    PATH_SCENARIO,
    PATH_TASK,
    PATHS,
    POSE_TASK,
    ROBOT,
)
from fulmar_benchmarks.drift.document import Key, document_of
from fulmar_benchmarks.drift.physics import physics_of
from fulmar_benchmarks.drift.unit import DriftCell
from fulmar_benchmarks.pairs import Pair, plan_of, with_law, with_policy
from fulmar_benchmarks.results import Outcome, PairResult, outcome_of
from fulmar_benchmarks.shape import Benchmark, Cell, Check, Figures, Found
from fulmar_benchmarks.tables import Shown
from fulmar_benchmarks.unit import costs, said_of, where_of
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.counts import check_episodes
from fulmar_core.simulation.episode import episode_steps
from fulmar_core.tasks import load_task
from fulmar_evaluation.evaluation import Trial
from policy_server.controllers import policies_directory


class Drift(Benchmark):
    """Every controller in every row."""

    name = "drift"
    title = "Fulmar beside DRIFT"
    report = "fulmar_benchmarks.drift.report.sections:plots"
    width = 170

    def check(self) -> None:
        """Refuse more episodes than the memory holds."""
        asked, robot = self.choice, load_robot(ROBOT)
        steps = episode_steps(load_task(POSE_TASK), robot.timing.control_s)
        at_once = min(asked.jobs, len(asked.rows) * len(asked.controllers))
        at_once = 1 if asked.through == "ros" else at_once  # through ros cells come one by one
        check_episodes(robot, episodes=asked.episodes, steps=steps, jobs=asked.jobs, at_once=at_once)

    @functools.cached_property
    def pairs(self) -> dict[Key, Pair]:
        """Who drives, by row and controller."""
        by_task = {
            (task, name): self._pair(task, name)
            for task in dict.fromkeys(map(_task_of_row, self.choice.rows))
            for name in self.choice.controllers
        }
        return {
            (row, name): by_task[_task_of_row(row), name]
            for row in self.choice.rows
            for name in self.choice.controllers
        }

    def _pair(self, task: str, controller: str) -> Pair:
        if controller != "policy":
            return with_law(ROBOT, task, controller)
        given = self.choice.policy if task == POSE_TASK else self.choice.tracking_policy
        return with_policy(ROBOT, task, given or policies_directory() / f"{ROBOT}_{task}")

    def _trial(self, row: str, pair: Pair) -> Trial:
        asked = self.choice
        condition = next((one for one in CONDITIONS if one.name == row), None)
        path = next((one for one in PATHS if one.name == row), None)
        plan = plan_of(
            pair,
            scenario=condition.scenario if condition else PATH_SCENARIO,
            seed=asked.seed,
            duration_s=PATH_EPISODE_S if path else None,
        )
        episodes = min(asked.episodes, PATH_EPISODES) if path else asked.episodes
        plan = replace(plan, goals=path.goals if path else "")
        return Trial(plan, asked.through, episodes, episodes, asked.jobs)

    def cells(self) -> list[DriftCell]:
        """Every pair that has a controller."""
        found = []
        for (row, name), pair in self.pairs.items():
            if pair.missing:
                continue
            trial = self._trial(row, pair)
            found.append(
                DriftCell(
                    name=f"{row}_{name}_{trial.through}", title=f"{row}, {name}", cost=costs(trial),
                    where=where_of(trial), way=trial.through, trial=trial, defines=pair.sha256,
                    bounds=self.choice.out / "outcomes", row=row, controller=name,
                )
            )  # fmt: skip
        return found

    def outcomes(self, found: Found) -> dict[Key, Outcome]:
        """What came of each row and controller."""
        return {(cell.row, cell.controller): outcome_of(found[cell.name]) for cell in self.cells()}

    def document(self, found: Found) -> dict[str, Any]:
        """docs/evaluation.md names its keys."""
        physics = {
            row: physics_of(self._trial(row, self.pairs[row, self.choice.controllers[0]]))
            for row in self.choice.rows
            if _task_of_row(row) == POSE_TASK
        }
        return document_of(self.choice, pairs=self.pairs, found=self.outcomes(found), physics=physics)

    def checks(self, document: Mapping[str, Any]) -> list[Check]:
        """Of each row and controller."""
        return [
            Check(f"{one['row']}, {one['controller']}: {one['figure']}", one["measured"], one["limit"], one["met"],
                  one["better"])
            for one in document["requirements"]
        ]  # fmt: skip

    def tables(self, document: Mapping[str, Any]) -> list[Shown]:
        """Both tables, what their figures are, what is not met, and the conclusion."""
        return shown(document)

    def conclusion(self, document: Mapping[str, Any]) -> str:
        """One sentence on what was required and met."""
        return conclusion(document)

    @property
    def style(self) -> str:  # type: ignore[override]
        """Colours of the bands."""
        return STYLE

    def drawn(self, document: Mapping[str, Any], found: Found) -> tuple[Any, ...]:
        """Document and outcomes."""
        every = self.outcomes(found)
        return document, {key: one for key, one in every.items() if isinstance(one, PairResult)}

    def said(self, cell: Cell, figures: Figures) -> str:
        """Its main figure."""
        own = figures["figures"]
        if "PT5_percent" in own:
            main = f"PT5 {own['PT5_percent'].mean():.1f} %, OT5 {own['OT5_percent'].mean():.1f} %"
        else:
            main = f"velocity error {own['velocity_error_m_s'].mean():.4f} m/s"
        return said_of(cell, figures, main)


def _task_of_row(row: str) -> str:
    return PATH_TASK if any(path.name == row for path in PATHS) else POSE_TASK
