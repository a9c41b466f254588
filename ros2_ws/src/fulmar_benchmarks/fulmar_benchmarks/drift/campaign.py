"""The benchmark after thesis Tables 3.5 and 3.6: every controller in every row, one document."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

from fulmar_benchmarks.drift.bounds import physics_of
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
from fulmar_benchmarks.drift.document import Key, Request, document_of
from fulmar_benchmarks.drift.unit import DriftUnit
from fulmar_benchmarks.pairs import Pair, code_hash, hash_of, plan_of, with_law, with_policy
from fulmar_benchmarks.results import CampaignResult
from fulmar_benchmarks.unit import Unit
from fulmar_benchmarks.workers import Outcome, evaluate_units
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.counts import check_episodes
from fulmar_core.simulation.episode import episode_steps
from fulmar_core.tasks import load_task
from fulmar_evaluation.evaluation import Trial
from policy_server.controllers import policies_directory


def run_drift(
    request: Request,
    *,
    progress: Callable[[float, float], None],
    on_done: Callable[[Unit, Outcome, bool], None],
) -> CampaignResult[Key]:
    """Evaluate every controller in every row, but for what was evaluated before with the same code and configuration.

    Arguments beside the request as in `evaluate_units`.
    """
    began = time.monotonic()
    robot = load_robot(ROBOT)
    steps = episode_steps(load_task(POSE_TASK), robot.timing.control_s)
    units_at_once = min(request.jobs, len(request.rows) * len(request.controllers))
    check_episodes(
        robot,
        episodes=request.episodes,
        steps=steps,
        jobs=request.jobs,
        at_once=1 if request.through == "ros" else units_at_once,  # through ros units come one by one
    )
    pairs = {
        (task, controller): _pair(request, task, controller)
        for task in dict.fromkeys(_task_of_row(row) for row in request.rows)
        for controller in request.controllers
    }
    code = code_hash(request.through)
    units = {
        (row, controller): _unit(request, row, controller, pairs[_task_of_row(row), controller], code)
        for row in request.rows
        for controller in request.controllers
        if not pairs[_task_of_row(row), controller].missing
    }
    outcomes = evaluate_units(
        list(units.values()), jobs=request.jobs, fresh=request.fresh, progress=progress, on_done=on_done
    )
    found = {key: outcomes[unit] for key, unit in units.items()}
    document = document_of(
        request,
        pairs={
            (row, name): pairs[_task_of_row(row), name]
            for row in request.rows
            for name in request.controllers
        },
        found=found,
        physics={
            row: physics_of(_trial(request, row, pairs[POSE_TASK, request.controllers[0]]))
            for row in request.rows
            if _task_of_row(row) == POSE_TASK
        },
        wall_s=time.monotonic() - began,
    )
    return CampaignResult.of(document, found)


def _task_of_row(row: str) -> str:
    return PATH_TASK if any(path.name == row for path in PATHS) else POSE_TASK


def _pair(request: Request, task: str, controller: str) -> Pair:
    if controller != "policy":
        return with_law(ROBOT, task, controller)
    given = request.policy if task == POSE_TASK else request.tracking_policy
    return with_policy(ROBOT, task, given or policies_directory() / f"{ROBOT}_{task}")


def _unit(request: Request, row: str, controller: str, pair: Pair, code: str) -> DriftUnit:
    return DriftUnit(
        _trial(request, row, pair),
        hash_of(pair.sha256, code),
        request.folder / "outcomes",
        row=row,
        controller=controller,
    )


def _trial(request: Request, row: str, pair: Pair) -> Trial:
    condition = next((one for one in CONDITIONS if one.name == row), None)
    path = next((one for one in PATHS if one.name == row), None)
    plan = plan_of(
        pair,
        scenario=condition.scenario if condition else PATH_SCENARIO,
        seed=request.seed,
        duration_s=PATH_EPISODE_S if path else None,
    )
    plan = replace(plan, goals=path.goals if path else "")
    episodes = min(request.episodes, PATH_EPISODES) if path else request.episodes
    return Trial(plan, request.through, episodes, episodes, request.jobs)
