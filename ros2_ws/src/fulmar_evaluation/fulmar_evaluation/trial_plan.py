"""From the options of `fulmar evaluate` to a checked trial, and from its figures to a table."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any

from rich.console import Console

from fulmar_bringup.console import new_table
from fulmar_bringup.plan_checks import checked_rate, chosen_policy
from fulmar_bringup.progress import step_bar
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system import check_names
from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.config.seeds import EVALUATION_SEED
from fulmar_core.loop.rollout import WORLDS
from fulmar_core.robots.basilisk_robots import BASILISK
from fulmar_core.robots.jsbsim_models import JSBSIM, is_jsbsim
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.counts import check_episodes
from fulmar_core.simulation.episode import episode_steps
from fulmar_core.tasks.path_task import evaluated_task
from fulmar_core.worlds.by_kind import check_scenario
from fulmar_core.worlds.scenario import check_delays, check_no_link, load_scenario
from fulmar_evaluation.evaluation import (
    BATCH_EPISODES,
    BOUNDED_EPISODES,
    EPISODES,
    WAYS,
    Trial,
    evaluate_trial,
)
from fulmar_evaluation.figures import FIGURES
from policy_server.controllers import controller_entry, usual_hz


def plan_trial(
    *,
    robot: str,
    task: str,
    controller: str,
    policy: Path | None = None,
    through: str = "mujoco",
    episodes: int | None = None,
    seed: int = EVALUATION_SEED,
    scenario: str = "nominal",
    control_hz: float | None = None,
    jobs: int | None = None,
    episode_s: float | None = None,
    steps: int | None = None,
    worlds: int | None = None,
    bounds: int | None = None,
    thing: str = "",
    along: str = "",
) -> Trial:
    """Complete and check a trial before anything starts; None stands for a default.

    Args:
        robot: Name of the robot.
        task: Name of the task.
        controller: Name of the controller.
        policy: Bundle.
        through: One of `WAYS`, `jsbsim`, `jsbsim:MODEL` or `basilisk`.
        episodes: Number of episodes.
        seed: Seed of the episodes.
        scenario: Name of the scenario.
        control_hz: Command rate [Hz].
        jobs: Processes, through ros.
        episode_s: Length of an episode [s].
        steps: The same, in control steps.
        worlds: Worlds of the batch.
        bounds: Episodes whose bound is computed.
        thing: Thing in space, as in `load_task`.
        along: Path, as in `Task.along`.

    Raises:
        ConfigError: Unknown name or impossible value.
        BundleError: The policy is damaged or made for something else.
    """
    is_simulator = is_jsbsim(through) or through == BASILISK
    if through not in WAYS and not is_simulator:
        raise UnknownNameError("way", through, (*WAYS, JSBSIM, BASILISK))
    backend = through if is_simulator else "mujoco"
    the_task = evaluated_task(task, thing=thing, along=along)
    check_names(robot, the_task, controller, backend)
    if controller_entry(controller).is_external:
        raise ConfigError(
            f"controller '{controller}' is a node of your own, which no evaluation can restart for each episode. "
            "Use `fulmar run`, or make it a class: docs/own-controller.md."
        )
    the_robot = load_robot(robot)
    check_scenario(the_robot, scenario)
    check_delays(the_robot, load_scenario(scenario))
    if through not in ("ros", "batch"):
        check_no_link(load_scenario(scenario), f"--through {through}")
    hz = checked_rate(the_robot, control_hz or usual_hz(controller, the_robot, the_task, policy))
    if episode_s is not None and steps is not None:
        raise ConfigError("--episode-s and --steps say the same thing. Give one of them.")
    if worlds is not None and through != "batch":
        raise ConfigError("--worlds belongs to --through batch.")
    control_dt = the_robot.timing.substeps(hz) * the_robot.timing.physics_dt
    duration_s = episode_s or (steps * control_dt if steps else the_task.episode_of(the_robot))
    window_s = the_task.tolerance.hold_s
    if duration_s < window_s:
        raise ConfigError(
            f"an episode of {duration_s:g} s is shorter than the {window_s:g} s that '{task}' is held in the end. "
            "Make it longer."
        )
    jobs = jobs or len(os.sched_getaffinity(0))
    episodes = episodes or (BATCH_EPISODES if through == "batch" else EPISODES)
    check_episodes(
        the_robot,
        episodes=episodes,
        steps=steps or round(duration_s / control_dt),
        worlds=(worlds or WORLDS) if through == "batch" else None,
        jobs=jobs if through == "ros" else 1,
    )
    policy = chosen_policy(controller, policy, the_robot, the_task, hz)
    plan = RunPlan(
        robot=robot,
        task=task,
        controller=controller,
        backend=backend,
        thing=the_task.thing,
        along=along,
        control_hz=hz,
        policy=str(policy.absolute()) if policy else "",
        scenario=scenario,
        seed=seed,
        duration_s=duration_s,
        lockstep=True,
    )
    return Trial(
        plan,
        through,
        episodes,
        worlds or WORLDS,
        jobs,
        bounds or BOUNDED_EPISODES,
    )


def trial_figures(trial: Trial) -> dict[str, Any]:
    """Run a trial with a progress bar; its figures, with what was run and how fast, ready for JSON."""
    plan, began = trial.plan, time.monotonic()
    timing = trial.robot.timing
    control_dt = timing.substeps(plan.control_hz) * timing.physics_dt
    with step_bar("evaluating", trial.episodes * episode_steps(trial.task, control_dt)) as progress:
        figures = evaluate_trial(trial, progress)
    wall_s = time.monotonic() - began
    return {
        "robot": plan.robot,
        "task": plan.task,
        **_among(trial),
        "controller": plan.controller,
        "through": trial.through,
        "scenario": plan.scenario,
        "seed": plan.seed,
        "control_hz": plan.control_hz,
        "episode_s": plan.duration_s,
        **figures,
        "wall_s": wall_s,
        "steps_per_s": figures["control_steps"] / wall_s,
    }


def _among(trial: Trial) -> dict[str, str]:
    """Names of the thing in space and of the path, where the task has them."""
    task = trial.task
    chosen = {"thing": task.thing, "path": str(getattr(task, "path", "") or "") if task.moves else ""}
    return {key: name for key, name in chosen.items() if name}


def print_figures(figures: dict[str, Any], output: Console) -> None:
    """Print the figures of `trial_figures` as a table, and the success in words."""
    f = figures
    table = new_table(
        f"{f['robot']} · {f['task']} · {f['controller']} · {f['scenario']}", [""], ["mean", "median", "p95"]
    )
    for name, value in f.items():
        if name in FIGURES:
            numbers = (value[key] for key in ("mean", "median", "p95"))
            table.add_row(name, *("–" if number is None else f"{number:.3f}" for number in numbers))
    output.print(table)
    if "bound" in f:
        line = f"bound on goals, of the first {f['bound_episodes']} episodes: {f['bound']}"
        output.print(line, markup=False, soft_wrap=True)
    for warning in f.get("warnings", []):
        output.print(f"warning: {warning}", markup=False, soft_wrap=True)
    line = (
        f"success {f['success_rate']:.3f} of {f['episodes']} episodes of {f['episode_s']:g} s "
        f"(seed {f['seed']}) through {f['through']}; {f['wall_s']:.1f} s, {f['steps_per_s']:,.0f} steps/s"
    )
    output.print(line, markup=False, soft_wrap=True)
