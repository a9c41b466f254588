"""The document of `fulmar parity`: divergence over time beside what sensors see, and success in each simulator."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_bringup.task_choice import default_task
from fulmar_core.config.atomic_write import write_whole
from fulmar_core.config.errors import ConfigError, FulmarError
from fulmar_core.loop.rollout import roll_out_in_backends
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from fulmar_evaluation.evaluation import Tally, Trial, evaluate_trial
from fulmar_evaluation.parity.divergence import (
    QUANTITIES,
    CoreRuns,
    divergence,
    noise_of,
    repeat_in,
    run_in_core,
)
from fulmar_evaluation.parity.simulators import CORE, MOCK, THROUGH, maker_of, missing_of, simulators_of
from fulmar_evaluation.success_interval import wilson
from fulmar_evaluation.trial_plan import plan_trial
from policy_server.controllers import usual_controller

TIMES_S = (
    0.2,
    1.0,
    2.0,
    5.0,
    10.0,
    20.0,
    30.0,
    60.0,
    120.0,
    300.0,
)  # that the document names, as far as runs last
Say = Callable[[str], None]


@dataclass(frozen=True)
class ParityRequest:
    """The options of `fulmar parity`; None where one was not given."""

    robot: str
    task: str | None
    controller: str | None
    policy: Path | None
    scenario: str
    runs: int  # repeated in each simulator
    duration_s: float | None  # of these [s]; that of an episode by default
    episodes: int  # of the evaluation in each; 0: none
    seed: int


def parity(request: ParityRequest, say: Say) -> dict[str, Any]:
    """Compare the simulators of a robot.

    Args:
        request: What to compare.
        say: Receives a line for each part.

    Returns:
        Ready for JSON: `divergence` by simulator and quantity, `noise` of the odometry, `success` by simulator, and
        `skipped` with the reason of each that is missing.

    Raises:
        FulmarError: Unknown name, impossible value, or the controller cannot run in the core.
    """
    trial = _trial(request)
    robot, task, scenario = trial.robot, trial.task, load_scenario(request.scenario)
    controller = trial.controller()
    dt = robot.timing.substeps(controller.control_hz) * robot.timing.physics_dt
    steps = max(1, round((request.duration_s or trial.plan.duration_s) / dt))
    say(f"{CORE}: {request.runs} runs of {steps * dt:g} s by '{trial.plan.controller}'")
    core = run_in_core(controller, robot, task, scenario, runs=request.runs, seed=request.seed, steps=steps)
    skipped, apart = missing_of(robot), {}
    for name in simulators_of(robot)[1:]:
        say(f"{name}: the same commands")
        try:
            motion = repeat_in(maker_of(name, robot, task, scenario), core)
        except (FulmarError, OSError) as error:  # OSError: an installation without its files
            skipped[name] = str(error)
            continue
        apart[name] = _parted(divergence(core.motion, motion), core, noise_of(robot))
    return {
        "robot": robot.name,
        "task": trial.plan.task,
        "controller": trial.plan.controller,
        "policy": trial.plan.policy or None,
        "scenario": request.scenario,
        "seed": request.seed,
        "control_hz": trial.plan.control_hz,
        "runs": request.runs,
        "duration_s": steps * dt,
        "noise": noise_of(robot),
        "divergence": apart,
        "episodes": request.episodes,
        "success": _successes(request, trial, [CORE, *apart], say) if request.episodes else {},
        "skipped": skipped,
    }


def _trial(request: ParityRequest) -> Trial:
    """The closed loop in the core, checked."""
    name = request.controller or ("policy" if request.policy else "")
    task = request.task or default_task(request.robot, name, "mujoco", goal=None, policy=request.policy)
    robot, the_task = load_robot(request.robot), load_task(task)
    the_task.check(robot)
    controller = name or usual_controller(robot, the_task, str(request.policy or ""))
    return _planned(request, task, controller, "batch")


def _planned(request: ParityRequest, task: str, controller: str, through: str) -> Trial:
    return plan_trial(
        robot=request.robot, task=task, controller=controller, policy=request.policy, through=through,
        episodes=max(1, request.episodes), seed=request.seed, scenario=request.scenario, control_hz=None, jobs=None,
        episode_s=None, steps=None, worlds=None, bounds=None,
    )  # fmt: skip


def _parted(apart: Mapping[str, np.ndarray], core: CoreRuns, noise: Mapping[str, float]) -> dict[str, Any]:
    """Divergence of one simulator: at some times, at its largest, and when a sensor would see it."""
    count = len(core.commands)
    ends = core.dt * np.arange(1, count + 1)
    rows = sorted({min(count - 1, int(np.searchsorted(ends, t - 1e-9))) for t in TIMES_S} | {count - 1})
    lost = np.isnan(apart["position_m"]).any(axis=0)
    found: dict[str, Any] = {"lost_runs": int(lost.sum())}
    kept = {name: values[:, ~lost] for name, values in apart.items()}
    if lost.all():
        return found
    for name in QUANTITIES:
        values = kept[name]
        median, most = np.median(values, axis=1), values.max(axis=1)
        seen = np.flatnonzero(median > noise[name]) if noise[name] > 0.0 else np.empty(0, dtype=int)
        found[name] = {
            "at": [
                {"time_s": float(ends[row]), "median": float(median[row]), "largest": float(most[row])}
                for row in rows
            ],
            "largest": float(most.max()),
            "seen_after_s": float(ends[seen[0]]) if len(seen) else None,
        }
    return found


def _successes(request: ParityRequest, trial: Trial, names: list[str], say: Say) -> dict[str, dict[str, Any]]:
    """Success of the controller in each simulator, over the same episodes."""
    found: dict[str, dict[str, Any]] = {}
    for name in names:
        say(f"{name}: {request.episodes} episodes")
        try:
            rate = _success(request, trial, name)
        except (FulmarError, OSError) as error:  # OSError: an installation without its files
            found[name] = {"problem": str(error)}
            continue
        low, high = wilson(rate, request.episodes)
        found[name] = {"success_rate": rate, "low": low, "high": high}
    return found


def _success(request: ParityRequest, trial: Trial, name: str) -> float:
    if name != MOCK:
        through = _planned(request, trial.plan.task, trial.plan.controller, THROUGH[name])
        return float(evaluate_trial(replace(through, bounded=1))["success_rate"])
    robot, task, scenario = trial.robot, trial.task, load_scenario(request.scenario)
    tally = Tally(task, robot)
    tally.add(
        roll_out_in_backends(
            trial.controller(), maker_of(name, robot, task, scenario), task, scenario,
            episodes=request.episodes, seed=request.seed,
        )
    )  # fmt: skip
    return float(np.mean(tally.succeeded))


def write_parity(document: dict[str, Any], page: str, folder: Path) -> None:
    """Write `parity.json` and the page `parity.md` into a folder, which is made."""
    folder.mkdir(parents=True, exist_ok=True)
    text = json.dumps(document, indent=2, allow_nan=False) + "\n"
    write_whole({folder / "parity.json": text.encode(), folder / "parity.md": page.encode()})


def check_request(request: ParityRequest) -> None:
    """Reject impossible numbers.

    Raises:
        ConfigError: A run is shorter than nothing.
    """
    if request.duration_s is not None and not 0.0 < request.duration_s <= TIMES_S[-1]:
        raise ConfigError(
            f"--duration {request.duration_s:g}: must be above 0 and at most {TIMES_S[-1]:g} s."
        )
