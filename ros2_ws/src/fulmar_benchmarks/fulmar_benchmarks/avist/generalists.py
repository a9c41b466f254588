"""Policies that learn for many paths or many bodies, beside others that learn for one, in as many updates each."""

from __future__ import annotations

import shutil
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from fulmar_benchmarks.shape import Cell, Figures, Found, Progress
from fulmar_core.config.seeds import HELD_OUT_SEED
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.counter_rng import WORLD, Draws
from fulmar_core.tasks import Task, load_task
from fulmar_core.tasks.inspect import Inspect
from fulmar_core.worlds.scenario import load_scenario
from fulmar_core.worlds.shaped_world import BRANCH, draw_bodies, robot_with

SEED = 1  # of learning
EPISODES = 64
SETTINGS = "free_flyer_bodies"  # of learning, but for what one body alone does not need
BODIES_TASK, ANY_BODY = "go_to_pose_3d", "morphologies"
OWN_BODIES = 2  # random bodies that have policies of their own
ALL = ""  # path, or body, of a generalist
NOMINAL = "nominal"  # body of the robot's file
MOST_BEHIND = 0.05  # aim: success of a generalist below that of policies of one path or body


@dataclass(frozen=True, kw_only=True)
class LearnedCell(Cell):
    """A policy that learns in one thread, and what it does then."""

    modules: ClassVar[tuple[str, ...]] = ("training.train", "training.evaluator", "training.bodies")
    robot: str
    updates: int
    runs: str  # folder of run folders

    def parts(self) -> dict[str, Any]:
        """With its settings, which no other package's hash has, and not where runs lie."""
        return {**super().parts(), "runs": "", "settings": asdict(self.learned()[2])}

    @abstractmethod
    def learned(self) -> tuple[Robot, Task, Any]:
        """Robot and task that it learns with, and the settings."""

    @abstractmethod
    def found(self, network: Any) -> Figures:
        """What the network does."""

    def measure(self, progress: Progress, pool: Any = None) -> Figures:
        """Learn anew, then evaluate."""
        from training.network import load_network
        from training.run_folder import NETWORK_FILE
        from training.train import train

        folder = Path(self.runs) / self.name
        shutil.rmtree(folder, ignore_errors=True)  # of a run that was broken off
        robot, task, settings = self.learned()
        record = train(
            robot, task, settings, seed=SEED, out=folder, updates=self.updates, watcher=_Reports(progress, self.cost)
        )  # fmt: skip
        made = {"updates": record["updates"], "cpu_s": record["cpu_s"], "steps": record["steps"]}
        return made | {"on": self.found(load_network(folder / NETWORK_FILE))}


class _Reports:
    """Reports to a benchmark how much of a run is done; see `training.progress.Watcher`."""

    def __init__(self, progress: Progress, cost: float) -> None:
        self._progress, self._cost = progress, cost

    def begin(self) -> None:
        """Nothing."""

    def advance(self, share: float, elapsed_s: float, steps: int) -> None:
        """See `Watcher`."""
        self._progress(share * self._cost)

    def evaluated(self, elapsed_s: float, success: float) -> None:
        """Nothing."""

    def end(self) -> None:
        """Nothing."""


@dataclass(frozen=True, kw_only=True)
class PathsCell(LearnedCell):
    """A policy that inspects along one path, or along all of them."""

    thing: str
    path: str  # or `ALL`
    paths: tuple[str, ...]  # that it is evaluated on

    def learned(self) -> tuple[Robot, Task, Any]:
        """See `LearnedCell`."""
        from training.settings import load_training_settings

        robot, task = load_robot(self.robot), load_task("inspect", self.thing)
        assert isinstance(task, Inspect)
        task = replace(task, training_paths=(self.path,) if self.path else self.paths)
        settings = load_training_settings(robot, task, SETTINGS)
        return robot, task, replace(settings, scenario=NOMINAL, body_inputs=False)  # its body never changes

    def found(self, network: Any) -> Figures:
        """Success and errors on each path."""
        from training.evaluator import evaluate_in_batch

        robot, nominal, found = load_robot(self.robot), load_scenario(NOMINAL), {}
        for path in self.paths:
            task = load_task("inspect", self.thing).along(path)
            task = replace(task, episode_s=task.episode_of(robot))  # type: ignore[type-var]
            figures = evaluate_in_batch(network, robot, task, nominal, episodes=EPISODES)
            found[path] = {
                "success_rate": figures["success_rate"], "path_error_m": figures["path_error_m"]["mean"],
                "pointing_error_deg": figures["pointing_error_deg"]["mean"],
            }  # fmt: skip
        return found


@dataclass(frozen=True, kw_only=True)
class BodiesCell(LearnedCell):
    """A policy that asks for a wrench, of one body or of any."""

    body: str  # `ALL`, `NOMINAL`, or the number of a random one

    def learned(self) -> tuple[Robot, Task, Any]:
        """See `LearnedCell`."""
        from training.settings import load_training_settings

        robot, task = body_of(self.robot, self.body or NOMINAL), load_task(BODIES_TASK)
        settings = load_training_settings(robot, task, SETTINGS)
        if self.body != ALL:  # what its body can do never changes
            settings = replace(settings, scenario=NOMINAL, body_inputs=False)
        return robot, task, settings

    def found(self, network: Any) -> Figures:
        """Success on the robot's own body, random ones of learning and others, and those with their own policies."""
        from training.evaluator import evaluate_in_batch

        task, nominal, shaped = load_task(BODIES_TASK), load_scenario(NOMINAL), load_scenario(ANY_BODY)

        def success(robot: Robot, scenario: Any, seed: int) -> float:
            figures = evaluate_in_batch(network, robot, task, scenario, episodes=EPISODES, seed=seed)
            return float(figures["success_rate"])

        own = {
            body: success(body_of(self.robot, body), nominal, HELD_OUT_SEED)
            for body in ((self.body and (self.body,)) or (NOMINAL, *map(str, range(OWN_BODIES))))
        }
        if self.body not in (ALL, NOMINAL):
            return own
        robot = load_robot(self.robot)
        return own | {
            "random": success(robot, shaped, SEED),
            "held_out": success(robot, shaped, HELD_OUT_SEED),
        }


def body_of(name: str, body: str) -> Robot:
    """The robot, with the random body of a number where it is one; the first that learning draws."""
    robot = load_robot(name)
    if body == NOMINAL:
        return robot
    numbers = np.array([int(body)])
    draws = Draws(SEED, numbers, np.zeros(1, dtype=int), WORLD).branch(BRANCH)
    return robot_with(robot, draw_bodies(robot, draws), 0)


def cells_of(robot: str, thing: str, paths: tuple[str, ...], updates: int, out: Path) -> list[LearnedCell]:
    """Generalists, and policies of each path and of some bodies alone."""
    shared: dict[str, Any] = {
        "robot": robot, "updates": updates, "runs": str(out / "runs"), "way": "training", "cost": 2e4 * updates,
    }  # fmt: skip
    found: list[LearnedCell] = [
        PathsCell(
            name=f"inspect_{path or 'all'}_{updates}", thing=thing, path=path, paths=(path,) if path else paths,
            **shared,
        )
        for path in (ALL, *paths)
    ]  # fmt: skip
    if load_robot(robot).morphology is not None:
        found += [
            BodiesCell(name=f"body_{body or 'any'}_{updates}", body=body, **shared)
            for body in (ALL, NOMINAL, *map(str, range(OWN_BODIES)))
        ]
    return found


def document_of(cells: list[LearnedCell], found: Found) -> dict[str, Any]:
    """`paths` by path and `bodies` by body: figures of `generalist` and `single`; and how each learned."""
    paths: dict[str, dict[str, Any]] = {}
    bodies: dict[str, dict[str, Any]] = {}
    learning = {}
    for cell in cells:
        each = found[cell.name]
        if isinstance(each, str):
            learning[cell.name] = {"error": each}
            continue
        learning[cell.name] = {key: each[key] for key in ("updates", "cpu_s", "steps")}
        if isinstance(cell, PathsCell):
            who, places = ("single" if cell.path else "generalist"), paths
        else:
            assert isinstance(cell, BodiesCell)
            who, places = ("single" if cell.body else "generalist"), bodies
        for name, figures in each["on"].items():
            places.setdefault(name, {})[who] = figures
    return {"paths": paths, "bodies": bodies, "learning": learning}


def behind(document: Mapping[str, Any]) -> dict[str, float | None]:
    """How much less often the generalist succeeds than policies of one path or body, the worst of these."""
    found: dict[str, float | None] = {}
    for kind, places in (("paths", document["paths"]), ("bodies", document["bodies"])):
        pairs = [
            [
                one["success_rate"] if isinstance(one, dict) else one
                for one in (each["single"], each["generalist"])
            ]
            for each in places.values()
            if {"single", "generalist"} <= set(each)
        ]
        found[kind] = max((special - general for special, general in pairs), default=None)
    return found
