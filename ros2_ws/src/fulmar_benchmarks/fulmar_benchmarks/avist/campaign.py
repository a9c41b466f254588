"""Laws and policies of a cubesat at its tasks, through MuJoCo and through live nodes."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from fulmar_benchmarks.avist import learners
from fulmar_benchmarks.avist.targets import (
    CONTROLLERS,
    FOLLOW,
    LAWS,
    LIVE_EPISODES,
    PUBLISHED,
    PUBLISHED_NOTE,
    of_live,
    of_tasks,
)
from fulmar_benchmarks.pairs import Pair, plan_of, with_law, with_policy
from fulmar_benchmarks.rans3d.document import figures_of
from fulmar_benchmarks.rans3d.unit import SpaceCell, SpaceTrial
from fulmar_benchmarks.results import outcome_of
from fulmar_benchmarks.shape import Benchmark, Cell, Check, Figures, Found
from fulmar_benchmarks.tables import Entry, Row, Shown, Table, display_name, number, tone_of
from fulmar_benchmarks.unit import costs, said_of, where_of
from policy_server.controllers import policies_directory

if TYPE_CHECKING:
    from fulmar_evaluation.report.page import Part

HEADS = (
    "success",
    "distance [m]",
    "attitude [°]",
    "velocity [m/s]",
    "turn rate [°/s]",
    "duty",
    "updates",
    "cpu s",
)
SHOWN = (
    ("success_rate", 3), ("position_error_m", 3), ("attitude_error_deg", 1), ("velocity_error_m_s", 3),
    ("rate_error_deg_s", 1), ("duty", 2), ("updates", 0), ("cpu_s", 0),
)  # fmt: skip


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
            if not pair.missing
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

    def cells(self) -> list[Cell]:
        """Trials, and learners."""
        return [*self._trials.values(), *self._learners]

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
        for task, by in self.pairs if "tasks" in asked.parts else ():
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
            "learners": learners.document_of(self._learners, found) if self._learners else None,
        }

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
        return [*of_tasks(tasks), *of_live(document["live"], tasks.get(FOLLOW, {}).get("policy"))]

    def tables(self, document: Mapping[str, Any]) -> list[Shown]:
        """A table of tasks, and what is required."""
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
        return said_of(cell, figures, f"success {figures['succeeded'].mean():.3f}")


def updates_of(training: Mapping[str, Any]) -> int | None:
    """Updates of a policy's training, from its passport; null where an off-policy learner has none."""
    if "updates" in training:
        return int(training["updates"])
    settings = training.get("settings", {})
    each = settings.get("worlds", 0) * settings.get("algorithm", {}).get("steps", 0)
    return round(training["steps"] / each) if each else None


def tasks_of(document: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Figures by task and controller."""
    policies = document["policies"]
    return {
        task: each | ({"policy": policies[task]} if task in policies else {})
        for task, each in document["laws"].items()
    }


def shown(document: Mapping[str, Any], checks: list[Check]) -> list[Shown]:
    """One row for each controller at each task, and why some could not be evaluated."""
    met = {check.name: check.met for check in checks}
    places = [
        (task, by, each[by]) for task, each in tasks_of(document).items() for by in CONTROLLERS if by in each
    ]
    places += [(f"{FOLLOW}, live", "policy", document["live"])] if document["live"] else []
    rows = [
        Row(
            (
                Entry(display_name(task)),
                Entry(by),
                Entry(number(each["success_rate"], 3), tone_of(met.get(f"{task}, {by}: success"))),
                *(Entry(number(each.get(key), digits)) for key, digits in SHOWN[1:]),
            )
        )
        for task, by, each in places
    ]
    missing = [f"{display_name(task)}, {by}: {each['reason']}" for task, by, each in places if each["reason"]]
    return [Table(display_name(document["robot"]), ("", "", *HEADS), rows, words=2), *missing]
