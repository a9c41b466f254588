"""Laws and policies of a cubesat at its tasks and along paths about things, through MuJoCo and live nodes."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fulmar_benchmarks.avist import generalists, learners
from fulmar_benchmarks.avist.tables import shown, tasks_of
from fulmar_benchmarks.avist.targets import (
    FOLLOW,
    INSPECT,
    LAWS,
    LIVE_EPISODES,
    PUBLISHED,
    PUBLISHED_NOTE,
    of_inspection,
    of_live,
    of_tasks,
)
from fulmar_benchmarks.pairs import Pair, plan_of, with_law, with_policy
from fulmar_benchmarks.rans3d.document import figures_of
from fulmar_benchmarks.rans3d.unit import SpaceCell, SpaceTrial
from fulmar_benchmarks.results import Outcome, outcome_of, statistics
from fulmar_benchmarks.shape import Benchmark, Cell, Check, Figures, Found
from fulmar_benchmarks.tables import Shown, display_name
from fulmar_benchmarks.unit import costs, said_of, where_of
from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from policy_server.controllers import policies_directory

if TYPE_CHECKING:
    from fulmar_evaluation.report.page import Part


class Avist(Benchmark):
    """Laws and policies at every task."""

    name = "avist"
    width = 150

    @property
    def title(self) -> str:  # type: ignore[override]
        """Of its page."""
        return f"{display_name(self.choice.robot)} at the tasks of RL-AVIST"

    @functools.cached_property
    def pairs(self) -> dict[tuple[str, str], Pair]:
        """Who drives, by task and controller."""
        asked = self.choice
        wanted = [(task, by) for task in asked.tasks for by in asked.controllers if "tasks" in asked.parts]
        wanted += [(FOLLOW, "policy")] * ("live" in asked.parts)
        wanted += [(INSPECT, by) for by in asked.controllers if "inspect" in asked.parts]
        return {place: self._pair(*place) for place in wanted}

    def _pair(self, task: str, controller: str) -> Pair:
        robot = self.choice.robot
        if controller in LAWS:
            return with_law(robot, task, controller)
        folder = (self.choice.policies or policies_directory()) / f"{robot}_{task}"
        pair = with_policy(robot, task, folder)
        if folder.is_dir():
            return pair
        return Pair(
            robot, task, "policy", reason=f"there is no bundle: `fulmar policies {folder.name}` makes it"
        )

    @functools.cached_property
    def _trials(self) -> dict[tuple[str, ...], SpaceCell]:
        """By task, controller and way, of pairs that have a controller."""
        asked = self.choice
        ways = {"mujoco": asked.episodes} if "tasks" in asked.parts else {}
        cells: dict[tuple[str, ...], SpaceCell] = {
            (*place, way): self._trial(pair, way, count)
            for place, pair in self.pairs.items()
            for way, count in ways.items()
            if not pair.missing and pair.task != INSPECT
        }
        live = self.pairs.get((FOLLOW, "policy"))
        if "live" in asked.parts and live is not None and not live.missing:
            cells[FOLLOW, "policy", "ros"] = self._trial(live, "ros", min(asked.episodes, LIVE_EPISODES))
        return cells

    def _trial(self, pair: Pair, way: str, episodes: int) -> SpaceCell:
        plan = plan_of(pair, scenario="nominal", seed=self.choice.seed)
        trial = SpaceTrial(plan, way, episodes, episodes, jobs=self.choice.jobs)
        place = pair.robot, pair.task, pair.controller, way
        return SpaceCell(
            name="_".join(place), title=", ".join(map(display_name, place)), cost=costs(trial), where=where_of(trial),
            way=way, trial=trial, defines=pair.sha256, bounds=self.choice.out / "outcomes",
        )  # fmt: skip

    @functools.cached_property
    def _flights(self) -> dict[tuple[str, str, str], SpaceCell | str]:
        """By thing, path and controller; a sentence where it is not flown."""
        asked = self.choice
        return {
            (thing, path, by): self._flight(thing, path, self.pairs[INSPECT, by])
            for thing in asked.things
            for path in asked.paths
            for by in asked.controllers
            if "inspect" in asked.parts
        }

    def _flight(self, thing: str, path: str, pair: Pair) -> SpaceCell | str:
        if pair.missing:
            return pair.reason
        robot, task = load_robot(pair.robot), load_task(INSPECT, thing).along(path)
        try:
            task.check(robot)
        except ConfigError as error:
            return str(error)
        cell = self._trial(pair, "mujoco", self.choice.rounds)
        plan = replace(cell.trial.plan, thing=thing, along=path, duration_s=task.episode_of(robot))
        trial = replace(cell.trial, plan=plan)
        place = INSPECT, thing, path, pair.controller
        return replace(
            cell,
            name="_".join(place),
            title=", ".join(map(display_name, place)),
            cost=costs(trial),
            trial=trial,
        )

    @functools.cached_property
    def _learned(self) -> list[generalists.LearnedCell]:
        asked = self.choice
        if "generalists" not in asked.parts:
            return []
        return generalists.cells_of(asked.robot, asked.things[0], asked.paths, asked.updates, asked.out)

    def cells(self) -> list[Cell]:
        """Trials, flights, learners, and policies of one body or path."""
        flights = [each for each in self._flights.values() if not isinstance(each, str)]
        return [*self._trials.values(), *flights, *self._learners, *self._learned]

    @functools.cached_property
    def _learners(self) -> list[learners.LearnerCell]:
        asked = self.choice
        if "learners" not in asked.parts:
            return []
        return learners.cells_of(
            asked.robot, FOLLOW, asked.learners, seeds=asked.seeds, samples=asked.samples, cpu_s=asked.cpu_s
        )

    def document(self, found: Found) -> dict[str, Any]:
        """docs/evaluation.md names its keys."""
        asked = self.choice
        tasks: dict[str, dict[str, Any]] = {}
        for task, by in [place for place in self.pairs if place[0] in asked.tasks]:
            tasks.setdefault(task, {})[by] = self._entry(found, task, by, "mujoco")
        return {
            "robot": asked.robot,
            "seed": asked.seed,
            "episodes": asked.episodes,
            "published_note": PUBLISHED_NOTE,
            "published": PUBLISHED,
            "policies": {task: each["policy"] for task, each in tasks.items() if "policy" in each},
            "laws": {task: {by: each[by] for by in LAWS if by in each} for task, each in tasks.items()},
            "live": self._entry(found, FOLLOW, "policy", "ros") if "live" in asked.parts else None,
            "inspect": self._inspections(found),
            "learners": learners.document_of(self._learners, found) if self._learners else None,
            "generalists": generalists.document_of(self._learned, found) if self._learned else None,
        }

    def _inspections(self, found: Found) -> dict[str, dict[str, dict[str, Any]]]:
        """Figures by thing, path and controller."""
        every: dict[str, dict[str, dict[str, Any]]] = {}
        for (thing, path, by), cell in self._flights.items():
            outcome = cell if isinstance(cell, str) else outcome_of(found[cell.name])
            every.setdefault(thing, {}).setdefault(path, {})[by] = inspection_of(outcome)
        return every

    def _entry(self, found: Found, task: str, by: str, way: str) -> dict[str, Any]:
        """Success, errors, and how a policy was made; null where it could not be evaluated, with the reason."""
        pair, cell = self.pairs[task, by], self._trials.get((task, by, way))
        outcome = outcome_of(found[cell.name]) if cell else pair.reason
        entry = figures_of(outcome) | {"reason": outcome if isinstance(outcome, str) else None}
        return entry | (
            {"updates": updates_of(pair.passport), "cpu_s": pair.passport.get("cpu_s")}
            if by == "policy"
            else {}
        )

    def checks(self, document: Mapping[str, Any]) -> list[Check]:
        """Success."""
        tasks = tasks_of(document)
        live = of_live(document["live"], tasks.get(FOLLOW, {}).get("policy"))
        return [*of_tasks(tasks), *live, *of_inspection(document["inspect"])]

    def tables(self, document: Mapping[str, Any]) -> list[Shown]:
        """Tables of tasks, inspections, generalists and learners, and what is required."""
        return [
            *shown(document, self.checks(document)),
            *learners.tables_of(document["learners"] or {}, FOLLOW),
            document["published_note"],
            *self.check_lines(document),
        ]

    def plots(self, document: Mapping[str, Any], found: Found) -> Sequence[Part]:
        """Curves of learners."""
        from fulmar_benchmarks.avist.learner_plots import plots_of

        return plots_of(document["learners"] or {})

    def said(self, cell: Cell, figures: Figures) -> str:
        """Its success."""
        if isinstance(cell, learners.LearnerCell):
            return f"return {figures['points'][-1]['returns']:.0f}"
        if not isinstance(cell, SpaceCell):
            return f"learned in {figures['cpu_s']:.0f} s of processor time"
        return said_of(cell, figures, f"success {figures['succeeded'].mean():.3f}")


def updates_of(training: Mapping[str, Any]) -> int | None:
    """Updates of a policy's training, from its passport; null where an off-policy learner has none."""
    if "updates" in training:
        return int(training["updates"])
    settings = training.get("settings", {})
    each = settings.get("worlds", 0) * settings.get("algorithm", {}).get("steps", 0)
    return round(training["steps"] / each) if each else None


EMPTY = dict.fromkeys(
    (
        "success_rate",
        "path_error_m",
        "pointing_error_deg",
        "least_distance_m",
        "coverage",
        "coverage_possible",
    )
)


def inspection_of(outcome: Outcome) -> dict[str, Any]:
    """Figures of some rounds about a thing; null where there is none, with the reason."""
    if isinstance(outcome, str):
        return {**EMPTY, "episodes": 0, "reason": outcome}
    its = outcome.figures
    return {
        "success_rate": float(outcome.succeeded.mean()),
        "path_error_m": {
            "mean": float(its["path_error_m"].mean()),
            "max": float(its["path_error_most_m"].max()),
        },
        "pointing_error_deg": {"mean": float(its["pointing_error_deg"].mean())},
        "least_distance_m": float(its["least_distance_m"].min()),
        **{
            name: statistics(its.get(name, np.zeros(0)))["mean"] for name in ("coverage", "coverage_possible")
        },
        "episodes": len(outcome.succeeded),
        "reason": None,
    }
