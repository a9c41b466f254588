"""`fulmar evaluate`: many episodes, every figure."""

from __future__ import annotations

import os
import time
from typing import Annotated, Any

import typer
from rich.table import Table

from fulmar_bringup.console import console, output, print_json
from fulmar_bringup.progress import step_bar
from fulmar_bringup.run_plan import RunPlan
from fulmar_cli.commands.arguments import (
    CalibrationOption,
    ControllerOption,
    JsonOption,
    PolicyOption,
    RobotArgument,
    ScenarioOption,
    SeedOption,
    TaskArgument,
)
from fulmar_core.episode import EVALUATION_SEED, episode_steps
from fulmar_core.errors import ConfigError, UnknownNameError
from fulmar_core.figures import FIGURES, meanings

EPILOG = f"""\b
What the figures mean. Of all but the first: mean, median and 95th percentile over the episodes.
{meanings()}
"""


def evaluate(
    robot: RobotArgument,
    task: TaskArgument,
    controller: ControllerOption = "policy",
    policy: PolicyOption = None,
    through: Annotated[
        str,
        typer.Option(
            metavar="batch|mujoco|ros",
            help="batch: the core's own dynamics. mujoco: an independent simulator. ros: the deployed nodes over DDS.",
        ),
    ] = "mujoco",
    episodes: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=1,
            help="Number of episodes; 4,096 in the batch, 256 elsewhere.",
        ),
    ] = None,
    seed: SeedOption = EVALUATION_SEED,
    scenario: ScenarioOption = "nominal",
    calibration: CalibrationOption = None,
    control_hz: Annotated[
        float | None, typer.Option(metavar="HZ", min=0.01, help="Command rate; the robot's own by default.")
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=1,
            help="Processes at once, through ros; one for each core.",
        ),
    ] = None,
    episode_s: Annotated[
        float | None,
        typer.Option(metavar="S", min=0.01, help="Length of an episode [s]; the task's own by default."),
    ] = None,
    steps: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="The same, as a number of control steps.")
    ] = None,
    worlds: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, help="Episodes at once in the batch; no figure depends on it."),
    ] = None,
    bounds: Annotated[
        int | None,
        typer.Option(
            metavar="N", min=1, help="Episodes, from the first on, whose bound on waypoints is computed; 256."
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Judge a controller over many episodes and print every figure.

    Episode i of a seed is the same in every way of running it. Success means staying inside the task's tolerance
    for its whole closing window.

    Try:

    fulmar evaluate floating_platform go_to_pose --controller lqr --through ros

    fulmar evaluate turtlebot2 go_through_positions --through batch --steps 1000
    """
    from fulmar_bringup.plan_checks import checked_rate, chosen_policy
    from fulmar_bringup.system import check_names, gains_note, modules_of
    from fulmar_cli.extras import require
    from fulmar_core.disturbances.scenario import check_delays, load_scenario
    from fulmar_core.robot import load_robot, use_calibration
    from fulmar_core.rollout import WORLDS
    from fulmar_core.tasks import load_task
    from fulmar_evaluation.evaluation import (
        BATCH_EPISODES,
        BOUNDED_EPISODES,
        EPISODES,
        WAYS,
        Trial,
        evaluate_trial,
    )
    from policy_server.controllers import controller_entry

    if through not in WAYS:
        raise UnknownNameError("way", through, WAYS)
    use_calibration(calibration, robot)
    check_names(robot, task, controller, "mujoco")
    if controller_entry(controller).is_external:
        raise ConfigError(
            f"controller '{controller}' is a node of your own, which no evaluation can begin anew for each episode. "
            "Use `fulmar run`, or make it a class: docs/own-controller.md."
        )
    the_robot, the_task = load_robot(robot), load_task(task)
    check_delays(the_robot, load_scenario(scenario))  # so that mistakes are told before anything is started
    hz = checked_rate(the_robot, control_hz or the_robot.timing.control_hz)
    if episode_s is not None and steps is not None:
        raise ConfigError("--episode-s and --steps say the same thing. Give one of them.")
    if worlds is not None and through != "batch":
        raise ConfigError("--worlds belongs to --through batch.")
    control_dt = the_robot.timing.substeps(hz) * the_robot.timing.physics_dt
    duration_s = episode_s or (steps * control_dt if steps else the_task.episode_s)
    window_s = the_task.tolerance.hold_s
    if duration_s < window_s:
        raise ConfigError(
            f"an episode of {duration_s:g} s is shorter than the {window_s:g} s that '{task}' is held in the end. "
            "Make it longer."
        )
    policy = chosen_policy(controller, policy, the_robot, the_task, hz)
    if note := gains_note(robot, controller):
        console.print(f"info: {note}", markup=False, soft_wrap=True)
    require(*modules_of(controller, "mock" if through == "batch" else "mujoco"))
    plan = RunPlan(
        robot=robot,
        task=task,
        controller=controller,
        backend="mujoco",
        control_hz=hz,
        policy=str(policy.absolute()) if policy else "",
        scenario=scenario,
        seed=seed,
        duration_s=duration_s,
        lockstep=True,
    )
    episodes = episodes or (BATCH_EPISODES if through == "batch" else EPISODES)
    trial = Trial(plan, through, episodes, worlds or WORLDS, jobs or _cores(), bounds or BOUNDED_EPISODES)
    began = time.monotonic()
    with step_bar("judging", episodes * episode_steps(trial.task, control_dt)) as progress:
        judged = evaluate_trial(trial, progress)
    wall_s = time.monotonic() - began
    figures = {
        "robot": robot,
        "task": task,
        "controller": controller,
        "through": through,
        "scenario": scenario,
        "seed": seed,
        "control_hz": hz,
        "episode_s": duration_s,
        **judged,
        "wall_s": wall_s,
        "steps_per_s": judged["control_steps"] / wall_s,
    }
    if as_json:
        print_json(figures)
    else:
        _print(figures)


def _cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0))


def _print(figures: dict[str, Any]) -> None:
    table = Table(
        title=f"{figures['robot']} · {figures['task']} · {figures['controller']} · {figures['scenario']}"
    )
    for column in ("", "mean", "median", "p95"):
        table.add_column(column, justify="left" if not column else "right")
    for name, value in figures.items():
        if name in FIGURES:
            numbers = (
                "–" if value[key] is None else f"{value[key]:.3f}" for key in ("mean", "median", "p95")
            )
            table.add_row(name, *numbers)
    output.print(table)
    if "bound" in figures:
        output.print(
            f"bound on goals, of the first {figures['bound_episodes']} episodes: {figures['bound']}",
            markup=False,
            soft_wrap=True,
        )
    output.print(
        f"success {figures['success_rate']:.3f} of {figures['episodes']} episodes of {figures['episode_s']:g} s "
        f"(seed {figures['seed']}) through {figures['through']}; {figures['wall_s']:.1f} s, "
        f"{figures['steps_per_s']:,.0f} steps/s"
    )
