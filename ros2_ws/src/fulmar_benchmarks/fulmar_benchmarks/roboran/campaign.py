"""The benchmark after thesis Table 4.7: every pair evaluated, one document."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fulmar_benchmarks.cells import heading_of, tally
from fulmar_benchmarks.pairs import Pair, find_pair, units_of
from fulmar_benchmarks.results import PairResult
from fulmar_benchmarks.roboran.document import pair_entry
from fulmar_benchmarks.unit import Unit
from fulmar_benchmarks.workers import Outcome, evaluate_units
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.counts import check_episodes
from fulmar_core.tasks import load_task
from fulmar_evaluation.evaluation import BATCH_EPISODES
from fulmar_evaluation.evaluation import EPISODES as MUJOCO_EPISODES

EPISODES = {"batch": BATCH_EPISODES, "mujoco": MUJOCO_EPISODES, "ros": 16}


@dataclass(frozen=True)
class Request:
    """What to evaluate."""

    robots: Sequence[str]
    tasks: Sequence[str]
    kinds: Sequence[str]  # out of KINDS
    episodes: dict[str, int]  # in each way
    seed: int
    scenario: str
    folder: Path  # outcomes are kept below it
    policies: Path | None = None  # folder of bundles; the shipped ones by default
    jobs: int = 2
    fresh: bool = False  # evaluate again what was evaluated before
    command: str = ""  # for the record


@dataclass(frozen=True)
class CampaignResult:
    """The document, and what plots are drawn from."""

    document: dict[str, Any]
    pairs: list[Pair]
    outcomes: dict[Pair, dict[str, PairResult]]


def run_benchmark(
    request: Request,
    *,
    progress: Callable[[float, float], None],
    on_done: Callable[[Unit, Outcome, bool], None],
) -> CampaignResult:
    """Evaluate every pair, but for what was evaluated before with the same code, configuration and controller.

    Arguments beside the request as in `evaluate_units`.
    """
    began = time.monotonic()
    longest_s = max(load_task(task).episode_s for task in request.tasks)
    at_once = min(request.jobs, len(request.tasks) * len(request.robots) * len(request.kinds))
    for robot in map(load_robot, request.robots):
        steps = round(longest_s * robot.timing.control_hz)
        episodes = max(request.episodes.values())
        check_episodes(robot, episodes=episodes, steps=steps, jobs=request.jobs, at_once=at_once)
    pairs = [
        find_pair(robot, task, kind, request.policies)
        for task in request.tasks
        for robot in request.robots
        for kind in request.kinds
    ]
    units = {
        pair: units_of(
            pair,
            request.episodes,
            seed=request.seed,
            scenario=request.scenario,
            folder=request.folder / "outcomes",
            worlds=max(request.episodes.get("batch", 1), 1),
        )
        for pair in pairs
        if not pair.missing
    }
    every = [unit for of_pair in units.values() for unit in of_pair]
    outcomes = evaluate_units(
        every, jobs=request.jobs, fresh=request.fresh, progress=progress, on_done=on_done
    )
    by_pair = {pair: {unit.trial.through: outcomes[unit] for unit in units.get(pair, [])} for pair in pairs}
    entries = [pair_entry(pair, by_pair[pair]) for pair in pairs]
    document = document_of(
        entries,
        episodes=request.episodes,
        seed=request.seed,
        scenario=request.scenario,
        command=request.command,
        wall_s=time.monotonic() - began,
    )
    evaluated = {
        pair: {way: outcome for way, outcome in ways.items() if isinstance(outcome, PairResult)}
        for pair, ways in by_pair.items()
    }
    return CampaignResult(document, pairs, evaluated)


def document_of(
    entries: list[dict[str, Any]],
    *,
    episodes: dict[str, int],
    seed: int,
    scenario: str,
    command: str,
    wall_s: float,
) -> dict[str, Any]:
    """The whole document; docs/evaluation.md names its keys."""
    met: dict[tuple[str, str], list[bool | None]] = {}
    for entry in entries:
        if entry["kind"] == "policy":
            met.setdefault((entry["robot"], entry["task"]), []).append(entry["met"])
    return {
        **heading_of("roboran", command),
        "seed": seed,
        "scenario": scenario,
        "episodes": dict(episodes),
        "pairs": entries,
        **tally(True if True in each else None if None in each else False for each in met.values()),
        "wall_s": round(wall_s, 1),
    }
