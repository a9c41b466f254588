"""The benchmark after thesis Table 4.7: every pair evaluated, one document."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fulmar_benchmarks.pairs import Pair, cells_of, find_pair
from fulmar_benchmarks.results import Outcome, PairResult, outcome_of
from fulmar_benchmarks.roboran.cells import conclusion, shown
from fulmar_benchmarks.roboran.document import pair_entry
from fulmar_benchmarks.shape import Benchmark, Cell, Check, Figures, Found, tally
from fulmar_benchmarks.tables import Shown
from fulmar_benchmarks.unit import TrialCell, said_of
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.counts import check_episodes
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from fulmar_evaluation.evaluation import BATCH_EPISODES
from fulmar_evaluation.evaluation import EPISODES as MUJOCO_EPISODES

EPISODES = {"batch": BATCH_EPISODES, "mujoco": MUJOCO_EPISODES, "ros": 16}


@dataclass(frozen=True)
class Findings:
    """The document, and what plots are drawn from."""

    document: Mapping[str, Any]
    pairs: list[Pair]
    outcomes: dict[Pair, dict[str, PairResult]]  # by way


class Roboran(Benchmark):
    """Every pair of a robot and a task."""

    name = "roboran"
    title = "Fulmar beside RoboRAN"
    report = "fulmar_benchmarks.roboran.report.sections:plots"
    width = 140

    @property
    def episodes(self) -> dict[str, int]:
        """In each way."""
        return {way: self.choice.episodes or EPISODES[way] for way in self.choice.through}

    def check(self) -> None:
        """Refuse an unknown scenario, and more episodes than the memory holds."""
        asked = self.choice
        load_scenario(asked.scenario)
        longest_s = max(load_task(task).episode_s for task in asked.tasks)
        at_once = min(asked.jobs, len(asked.tasks) * len(asked.robots) * len(asked.controllers))
        for robot in map(load_robot, asked.robots):
            steps = round(longest_s * robot.timing.control_hz)
            episodes = max(self.episodes.values())
            check_episodes(robot, episodes=episodes, steps=steps, jobs=asked.jobs, at_once=at_once)

    @functools.cached_property
    def pairs(self) -> list[Pair]:
        """Every robot at every task, by every kind of controller."""
        asked = self.choice
        every = itertools.product(asked.tasks, asked.robots, asked.controllers)
        return [find_pair(robot, task, kind, asked.policies) for task, robot, kind in every]

    def _cells(self, pair: Pair) -> list[TrialCell]:
        asked, episodes = self.choice, self.episodes
        if pair.missing:
            return []
        return cells_of(
            pair, episodes, seed=asked.seed, scenario=asked.scenario, bounds=asked.out / "outcomes",
            worlds=max(episodes.get("batch", 1), 1),
        )  # fmt: skip

    def cells(self) -> list[TrialCell]:
        """Every pair that has a controller, in every way."""
        return [cell for pair in self.pairs for cell in self._cells(pair)]

    def _outcomes(self, found: Found, pair: Pair) -> dict[str, Outcome]:
        return {cell.way: outcome_of(found[cell.name]) for cell in self._cells(pair)}

    def document(self, found: Found) -> dict[str, Any]:
        """docs/evaluation.md names its keys."""
        entries = [pair_entry(pair, self._outcomes(found, pair)) for pair in self.pairs]
        return document_of(
            entries, episodes=self.episodes, seed=self.choice.seed, scenario=self.choice.scenario
        )

    def checks(self, document: Mapping[str, Any]) -> list[Check]:
        """Every requirement on every pair."""
        return [
            Check(
                f"{entry['robot']}, {entry['task']}: {one['name']}", one["measured"], one["limit"], one["met"]
            )
            for entry in document["pairs"]
            for one in entry["verdicts"]
        ]

    def tables(self, document: Mapping[str, Any]) -> list[Shown]:
        """One table a task, what the figures are, and the conclusion."""
        return shown(document)

    def conclusion(self, document: Mapping[str, Any]) -> str:
        """One sentence on what was required and met."""
        return conclusion(document)

    def drawn(self, document: Mapping[str, Any], found: Found) -> tuple[Any, ...]:
        """Findings."""
        evaluated = {
            pair: {
                way: one for way, one in self._outcomes(found, pair).items() if isinstance(one, PairResult)
            }
            for pair in self.pairs
        }
        return (Findings(document, self.pairs, evaluated),)

    def said(self, cell: Cell, figures: Figures) -> str:
        """Its success."""
        return said_of(cell, figures, f"success {figures['succeeded'].mean():.3f}")


def document_of(
    entries: list[dict[str, Any]], *, episodes: dict[str, int], seed: int, scenario: str
) -> dict[str, Any]:
    """Its keys; `asked`, `met` and `open` count pairs that a policy drives."""
    met: dict[tuple[str, str], list[bool | None]] = {}
    for entry in entries:
        if entry["kind"] == "policy":
            met.setdefault((entry["robot"], entry["task"]), []).append(entry["met"])
    return {
        "seed": seed,
        "scenario": scenario,
        "episodes": dict(episodes),
        "pairs": entries,
        **tally(True if True in each else None if None in each else False for each in met.values()),
    }
