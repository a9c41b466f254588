"""The benchmark after the 3-D tasks of RANS: every controller at every task, the integrator and the pace."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, cast

from fulmar_benchmarks.pairs import Pair, code_hash, hash_of, plan_of, with_law, with_policy
from fulmar_benchmarks.rans3d.bound import bounds_of
from fulmar_benchmarks.rans3d.document import Key, Request, document_of
from fulmar_benchmarks.rans3d.integrator import measure_integrator
from fulmar_benchmarks.rans3d.pace import measure_pace
from fulmar_benchmarks.rans3d.targets import (
    DEAD,
    DEAD_CONTROLLERS,
    DEAD_TASK,
    EPISODES,
    ROBOTS,
    how_to_make,
)
from fulmar_benchmarks.rans3d.unit import SpaceTrial, SpaceUnit
from fulmar_benchmarks.results import CampaignResult
from fulmar_benchmarks.unit import Unit
from fulmar_benchmarks.workers import Outcome, evaluate_units
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.counts import check_episodes
from fulmar_core.simulation.episode import episode_steps
from fulmar_core.tasks import load_task
from policy_server.controllers import policies_directory

WAY = "mujoco"


def run_rans3d(
    request: Request,
    *,
    progress: Callable[[float, float], None],
    on_done: Callable[[Unit, Outcome, bool], None],
) -> CampaignResult[Key]:
    """Measure everything that is asked for; evaluations with the same code and configuration are not repeated.

    Arguments beside the request as in `evaluate_units`.
    """
    began = time.monotonic()
    keys = _keys(request)
    _check(request, keys)
    pairs = {key[:3]: _pair(request, *key[:3]) for key in keys}
    code = code_hash(WAY) if keys else ""
    units = {key: _unit(request, pairs[key[:3]], key[3], code) for key in keys if not pairs[key[:3]].missing}
    outcomes = evaluate_units(
        list(units.values()), jobs=request.jobs, fresh=request.fresh, progress=progress, on_done=on_done
    )
    found = {key: outcomes[unit] for key, unit in units.items()}
    counting = {
        key[:2]: cast(SpaceTrial, unit.trial)
        for key, unit in units.items()
        if unit.trial.task.required is not None
    }
    parts: dict[str, Any] = {
        "bounds": bounds_of(counting, jobs=request.jobs),
        "integrator": None,
        "throughput": None,
    }
    if "integrator" in request.parts:
        robots = [load_robot(name) for name in request.robots]
        parts["integrator"] = measure_integrator(
            robots, request.tumble_s, jobs=request.jobs, progress=progress
        )
    if "throughput" in request.parts:  # last and alone
        parts["throughput"] = measure_pace(
            worlds=request.worlds, cores=request.jobs, seconds=request.seconds, progress=progress
        )
    document = document_of(
        request, pairs=pairs, keys=keys, found=found, wall_s=time.monotonic() - began, **parts
    )
    return CampaignResult.of(document, found)


def _keys(request: Request) -> list[Key]:
    keys: list[Key] = []
    if "tasks" in request.parts:
        keys += [
            (robot, task, controller, scenario)
            for robot in request.robots
            for task in request.tasks
            for controller in request.controllers
            for scenario in request.scenarios
        ]
    if "dead" in request.parts and ROBOTS[0] in request.robots:
        keys += [
            (ROBOTS[0], DEAD_TASK, controller, scenario)
            for scenario in DEAD
            for controller in DEAD_CONTROLLERS
            if controller in request.controllers
        ]
    return keys


def _check(request: Request, keys: list[Key]) -> None:
    for name in dict.fromkeys(key[0] for key in keys):
        robot = load_robot(name)
        steps = max(
            episode_steps(load_task(key[1]), robot.timing.control_s) for key in keys if key[0] == name
        )
        at_once = min(request.jobs, len(keys))
        check_episodes(robot, episodes=request.episodes, steps=steps, jobs=request.jobs, at_once=at_once)


def _pair(request: Request, robot: str, task: str, controller: str) -> Pair:
    if controller != "policy":
        return with_law(robot, task, controller)
    folder = (request.policies or policies_directory()) / f"{robot}_{task}"
    pair = with_policy(robot, task, folder)
    if folder.is_dir():
        return pair
    return Pair(robot, task, "policy", reason=f"there is no bundle {folder.name}: {how_to_make(robot, task)}")


def _unit(request: Request, pair: Pair, scenario: str, code: str) -> SpaceUnit:
    farthest, seconds = EPISODES.get(pair.robot, (0.0, None))
    plan = plan_of(pair, scenario=scenario, seed=request.seed, duration_s=seconds)
    trial = SpaceTrial(plan, WAY, request.episodes, request.episodes, farthest_m=farthest)
    return SpaceUnit(trial, hash_of(pair.sha256, code, f"{farthest:g}"), request.folder / "outcomes")
