"""The outcome of the benchmark as one JSON-ready document: what tables, pages and other programs read."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from fulmar_benchmarks.pairs import Pair
from fulmar_benchmarks.rans3d.targets import (
    AIMED_RATIO,
    AIMED_STEPS_PER_S,
    DEAD,
    DEAD_CONTROLLERS,
    DEAD_TASK,
    LEAST_RATIO,
    LEAST_WITH_DEAD,
    MOST_DUTY,
    MOST_ENERGY,
    MOST_FROM_JACOBI,
    MOST_MOMENTUM,
    NOMINAL,
    PUBLISHED_NOTE,
    RANDOMISED,
    REQUIRED,
    ROBOTS,
    published,
)
from fulmar_benchmarks.rans3d.unit import HELD
from fulmar_benchmarks.results import PairResult
from fulmar_benchmarks.shape import Choice
from fulmar_core.simulation.metrics import summarise
from fulmar_evaluation.success_interval import wilson

Key = tuple[str, str, str, str]  # robot, task, controller, scenario
Cells = dict[str, dict[str, dict[str, Any]]]  # by task and controller
# Keys of a cell, by the figures whose means they are.
MEANS = {
    "position_error_m": "final_position_error_m",
    "attitude_error_deg": "final_attitude_error_deg",
    "velocity_error_m_s": "velocity_error_m_s",
    "rate_error_deg_s": "rate_error_deg_s",
    "goals_reached": "goals_reached",
    "duty": "effort",
    "rans_success_rate": "held_rans_tolerance",
}


def document_of(
    choice: Choice,
    *,
    pairs: dict[tuple[str, str, str], Pair],
    keys: list[Key],
    found: dict[Key, PairResult | str],
    bounds: dict[tuple[str, str], np.ndarray],
    integrator: dict[str, Any] | None,
    throughput: dict[str, Any] | None,
) -> dict[str, Any]:
    """The whole document; docs/evaluation.md names its keys.

    Args:
        choice: What was asked for.
        pairs: Who drives, by robot, task and controller.
        keys: What was to be evaluated.
        found: Results, or why there is none.
        bounds: Most targets of the first episodes, by robot and task that counts them.
        integrator: Of `measure_integrator`; None: not measured.
        throughput: Of `measure_pace`; None: not measured.
    """
    cells = {robot: _cells(choice, robot, pairs, found, bounds) for robot in ROBOTS}
    dead = [
        figures_of(found.get((ROBOTS[0], DEAD_TASK, controller, scenario)))
        | {"scenario": scenario, "dead": count, "of": 16, "task": DEAD_TASK, "controller": controller}
        for scenario, count in DEAD.items()
        for controller in DEAD_CONTROLLERS
        if (ROBOTS[0], DEAD_TASK, controller, scenario) in keys
    ]
    requirements = [*_of_cells(cells), *_of_integrator(integrator), *_of_pace(throughput)]
    return {
        "seed": choice.seed,
        "through": "mujoco",
        "episodes": choice.episodes,
        "controllers": list(choice.controllers),
        "scenarios": list(choice.scenarios),
        "published_note": PUBLISHED_NOTE,
        "tasks": cells[ROBOTS[0]],
        ROBOTS[1]: cells[ROBOTS[1]],
        "dead_thrusters": dead,
        "integrator": integrator,
        "throughput": throughput,
        "requirements": requirements,
        "aims": [*_aims_of_cells(cells, dead), *_aims_of_pace(throughput)],
    }


def _cells(
    choice: Choice,
    robot: str,
    pairs: dict[tuple[str, str, str], Pair],
    found: dict[Key, PairResult | str],
    bounds: dict[tuple[str, str], np.ndarray],
) -> Cells:
    if robot not in choice.robots or "tasks" not in choice.parts:
        return {}
    return {
        task: {
            name: _cell(
                choice, pairs[robot, task, name], (robot, task, name), found, bounds.get((robot, task))
            )
            for name in choice.controllers
        }
        for task in choice.tasks
    }


def _cell(
    choice: Choice,
    pair: Pair,
    place: tuple[str, str, str],
    found: dict[Key, PairResult | str],
    bound: np.ndarray | None,
) -> dict[str, Any]:
    outcomes = {scenario: found.get((*place, scenario)) for scenario in choice.scenarios}
    faults = [f"{scenario}: {one}" for scenario, one in outcomes.items() if isinstance(one, str)]
    missing, good = pair.missing, any(isinstance(one, PairResult) for one in outcomes.values())
    entry = figures_of(outcomes.get(NOMINAL)) | {
        "published": published(*place[:2]),
        "status": "missing" if missing else "evaluated" if good and not faults else "failed",
        "reason": pair.reason or "; ".join(faults) or None,
        "law": pair.law or None,
        "sha256": pair.sha256 or None,
    }
    nominal = outcomes.get(NOMINAL)
    if bound is not None and isinstance(nominal, PairResult):
        reached = nominal.figures["goals_reached"][: len(bound)]
        entry["goals_bound"] = float(np.mean(bound))
        entry["share_of_bound"] = float(np.mean(reached / np.maximum(bound, 1)))
    if RANDOMISED in outcomes:
        entry[RANDOMISED] = figures_of(outcomes[RANDOMISED])
    return entry


def figures_of(outcome: PairResult | str | None) -> dict[str, Any]:
    """Success and errors of one evaluation; null where there is none.

    Returns:
        Success rate, errors and the other keys of `MEANS` as means over the episodes, null where a task has no such
        figure; `figures`: of each mean, median and 95th percentile; `holdable` with some of them where the linear
        programme was asked.
    """
    if not isinstance(outcome, PairResult):
        return {"success_rate": None, **dict.fromkeys(MEANS), "episodes": 0, "figures": {}}
    entry = _statistics(outcome, np.ones(len(outcome.succeeded), dtype=bool))
    about = outcome.about
    entry["success_interval"] = list(wilson(entry["success_rate"], entry["episodes"]))
    entry |= {key: about[key] for key in ("scenario", "control_hz", "episode_s", "control_steps", "wall_s")}
    if HELD in outcome.more:
        able = outcome.more[HELD]
        few = _statistics(outcome, able)
        entry["holdable"] = {key: value for key, value in few.items() if key != "figures"}
    return entry


def _statistics(outcome: PairResult, chosen: np.ndarray) -> dict[str, Any]:
    if not chosen.any():
        return {"success_rate": None, **dict.fromkeys(MEANS), "episodes": 0, "figures": {}}
    figures = summarise(
        outcome.succeeded[chosen], {name: values[chosen] for name, values in outcome.figures.items()}
    )
    success, episodes = figures.pop("success_rate"), figures.pop("episodes")
    means = {key: figures[name]["mean"] if name in figures else None for key, name in MEANS.items()}
    return {"success_rate": success, **means, "episodes": episodes, "figures": figures}


def _line(name: str, measured: float | None, limit: float, *, at_least: bool) -> dict[str, Any]:
    met = None if measured is None else measured >= limit if at_least else measured <= limit
    better = "more" if at_least else "less"
    return {"name": name, "measured": measured, "limit": limit, "better": better, "met": met}


def _of_cells(cells: dict[str, Cells]) -> list[dict[str, Any]]:
    lines = []
    for asked in REQUIRED:
        cell = cells[asked.robot].get(asked.task, {}).get(asked.controller)
        if cell is None or (asked.among_holdable and RANDOMISED not in cell):
            continue
        shown = cell[RANDOMISED].get("holdable", {}) if asked.among_holdable else cell
        kind = "randomised that can be held" if asked.among_holdable else NOMINAL
        line = _line(
            f"{asked.robot}, {asked.task}, {asked.controller}, {kind}: success",
            shown.get("success_rate"),
            asked.limit,
            at_least=True,
        )
        lines.append(line | {key: value for key, value in asdict(asked).items() if key != "limit"})
    return lines


def _of_integrator(found: dict[str, Any] | None) -> list[dict[str, Any]]:
    if found is None:
        return []
    limits = {"energy": MOST_ENERGY, "momentum": MOST_MOMENTUM, "from_jacobi": MOST_FROM_JACOBI}
    return [
        _line(
            f"integrator at {one['step_s']:g} s, float64: {name}", one["float64"][name], limit, at_least=False
        )
        for one in found["robots"].values()
        for name, limit in limits.items()
    ]


def _of_pace(found: dict[str, Any] | None) -> list[dict[str, Any]]:
    if found is None:
        return []
    return [
        _line(
            f"throughput, {library}: times MuJoCo's rollout",
            (found[library] or {}).get("ratio"),
            limit,
            at_least=True,
        )
        for library, limit in LEAST_RATIO.items()
    ]


def _aims_of_cells(cells: dict[str, Cells], dead: list[dict[str, Any]]) -> list[dict[str, Any]]:
    duties = [
        _line(
            f"{ROBOTS[0]}, {task}, {name}: share of time that valves are open",
            cell["duty"],
            MOST_DUTY,
            at_least=False,
        )
        for task, controllers in cells[ROBOTS[0]].items()
        for name, cell in controllers.items()
        if cell["duty"] is not None
    ]
    return duties + [
        _line(
            f"{one['dead']} of {one['of']} thrusters dead, {DEAD_TASK}, {one['controller']}: success",
            one["success_rate"],
            LEAST_WITH_DEAD,
            at_least=True,
        )
        for one in dead
    ]


def _aims_of_pace(found: dict[str, Any] | None) -> list[dict[str, Any]]:
    best = (found or {}).get("compiled")
    if best is None:
        return []
    return [
        _line("throughput, compiled: steps/s", best["batch_steps_per_s"], AIMED_STEPS_PER_S, at_least=True),
        _line("throughput, compiled: times MuJoCo's rollout", best["ratio"], AIMED_RATIO, at_least=True),
    ]
