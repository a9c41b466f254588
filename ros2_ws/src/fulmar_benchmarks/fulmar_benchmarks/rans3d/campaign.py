"""The benchmark after the 3-D tasks of RANS: every controller at every task, the integrator and the pace."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any, cast

from fulmar_benchmarks.pairs import Pair, plan_of, with_law, with_policy
from fulmar_benchmarks.rans3d.bound import BoundCell, bound_cell
from fulmar_benchmarks.rans3d.document import Key, document_of
from fulmar_benchmarks.rans3d.integrator import integrator_of, tumbles
from fulmar_benchmarks.rans3d.pace import pace_cell
from fulmar_benchmarks.rans3d.tables import conclusion, shown
from fulmar_benchmarks.rans3d.targets import (
    DEAD,
    DEAD_CONTROLLERS,
    DEAD_TASK,
    EPISODES,
    ROBOTS,
    how_to_make,
)
from fulmar_benchmarks.rans3d.unit import SpaceCell, SpaceTrial
from fulmar_benchmarks.results import Outcome, PairResult, outcome_of
from fulmar_benchmarks.shape import Benchmark, Cell, Check, Choice, Figures, Found, known
from fulmar_benchmarks.tables import Shown, display_name
from fulmar_benchmarks.unit import costs, said_of
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.counts import check_episodes
from fulmar_core.simulation.episode import episode_steps
from fulmar_core.tasks import load_task
from policy_server.controllers import policies_directory

WAY = "mujoco"


class Rans3d(Benchmark):
    """Every controller at every task, thrusters that are dead, the integrator and the pace."""

    name = "rans3d"
    title = "Fulmar at the 3-D tasks of RANS"
    report = "fulmar_benchmarks.rans3d.report.plots:plots"
    width = 180

    @functools.cached_property
    def keys(self) -> list[Key]:
        """What is to be evaluated."""
        return _keys(self.choice)

    @functools.cached_property
    def pairs(self) -> dict[tuple[str, str, str], Pair]:
        """Who drives, by robot, task and controller."""
        return {key[:3]: pair_of(self.choice, *key[:3]) for key in self.keys}

    def check(self) -> None:
        """Refuse more episodes than the memory holds."""
        asked, keys = self.choice, self.keys
        for name in dict.fromkeys(key[0] for key in keys):
            robot = load_robot(name)
            steps = max(
                episode_steps(load_task(key[1]), robot.timing.control_s) for key in keys if key[0] == name
            )
            at_once = min(asked.jobs, len(keys))
            check_episodes(robot, episodes=asked.episodes, steps=steps, jobs=asked.jobs, at_once=at_once)

    @functools.cached_property
    def _trials(self) -> dict[Key, SpaceCell]:
        """Of pairs that have a controller."""
        return {
            key: cell_of(self.choice, self.pairs[key[:3]], key[3])
            for key in self.keys
            if not self.pairs[key[:3]].missing
        }

    @property
    def _bounds(self) -> dict[tuple[str, str], BoundCell]:
        """Of robots and tasks that count targets."""
        return {
            key[:2]: bound_cell(cast(SpaceTrial, cell.trial))
            for key, cell in self._trials.items()
            if cell.trial.task.required is not None
        }

    def cells(self) -> list[Cell]:
        """Trials and their bounds, tumbles, and the pace, last and alone."""
        asked, parts = self.choice, self.choice.parts
        return [
            *self._trials.values(),
            *self._bounds.values(),
            *(tumbles(asked.robots, asked.tumble_s) if "integrator" in parts else []),
            *([pace_cell(asked.worlds, asked.jobs, asked.seconds)] if "throughput" in parts else []),
        ]

    def outcomes(self, found: Found) -> dict[Key, Outcome]:
        """What came of each trial."""
        return {key: outcome_of(found[cell.name]) for key, cell in self._trials.items()}

    def document(self, found: Found) -> dict[str, Any]:
        """docs/evaluation.md names its keys."""
        asked, parts = self.choice, self.choice.parts
        return document_of(
            asked,
            pairs=self.pairs,
            keys=self.keys,
            found=self.outcomes(found),
            bounds={place: known(found, cell.name)["goals"] for place, cell in self._bounds.items()},
            integrator=integrator_of(asked.robots, asked.tumble_s, found) if "integrator" in parts else None,
            throughput=known(found, "throughput") if "throughput" in parts else None,
        )

    def checks(self, document: Mapping[str, Any]) -> list[Check]:
        """Success, drifts and pace."""
        return [check_of(line) for line in document["requirements"]]

    def tables(self, document: Mapping[str, Any]) -> list[Shown]:
        """One table a robot, the other parts line by line, what is required and aimed at, and the conclusion."""
        aims = [f"aim: {check_of(line).line}" for line in document["aims"]]
        return [*shown(document), *self.check_lines(document), *aims, conclusion(document)]

    def conclusion(self, document: Mapping[str, Any]) -> str:
        """One sentence on what was required and met."""
        return conclusion(document)

    def drawn(self, document: Mapping[str, Any], found: Found) -> tuple[Any, ...]:
        """Document and outcomes."""
        every = self.outcomes(found)
        return document, {key: one for key, one in every.items() if isinstance(one, PairResult)}

    def said(self, cell: Cell, figures: Figures) -> str:
        """Its success."""
        if not isinstance(cell, SpaceCell):
            return "measured"
        return said_of(cell, figures, f"success {figures['succeeded'].mean():.3f}")


def check_of(line: Mapping[str, Any]) -> Check:
    """A requirement of a document."""
    return Check(*(line[key] for key in ("name", "measured", "limit", "met", "better")))


def _keys(asked: Choice) -> list[Key]:
    keys: list[Key] = []
    if "tasks" in asked.parts:
        keys += [
            (robot, task, controller, scenario)
            for robot in asked.robots
            for task in asked.tasks
            for controller in asked.controllers
            for scenario in asked.scenarios
        ]
    if "dead" in asked.parts and ROBOTS[0] in asked.robots:
        keys += [
            (ROBOTS[0], DEAD_TASK, controller, scenario)
            for scenario in DEAD
            for controller in DEAD_CONTROLLERS
            if controller in asked.controllers
        ]
    return keys


def pair_of(asked: Choice, robot: str, task: str, controller: str) -> Pair:
    """The controllers of a robot at a task, or why one is missing."""
    if controller != "policy":
        return with_law(robot, task, controller)
    folder = (asked.policies or policies_directory()) / f"{robot}_{task}"
    pair = with_policy(robot, task, folder)
    if folder.is_dir():
        return pair
    return Pair(robot, task, "policy", reason=f"there is no bundle {folder.name}: {how_to_make(robot, task)}")


def cell_of(asked: Choice, pair: Pair, scenario: str) -> SpaceCell:
    """A pair in a scenario."""
    farthest, seconds = EPISODES.get(pair.robot, (0.0, None))
    plan = plan_of(pair, scenario=scenario, seed=asked.seed, duration_s=seconds)
    trial = SpaceTrial(plan, WAY, asked.episodes, asked.episodes, farthest_m=farthest)
    place = pair.robot, pair.task, pair.controller, scenario
    return SpaceCell(
        name="_".join(place), title=", ".join(map(display_name, place)), cost=costs(trial), way=WAY, trial=trial,
        defines=pair.sha256, bounds=asked.out / "outcomes",
    )  # fmt: skip
