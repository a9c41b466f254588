"""`fulmar evaluate`: many episodes, every figure."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import Annotated, Any

import typer
from rich.table import Table

from fulmar_bringup.commands.arguments import (
    ControllerOption,
    JsonOption,
    PolicyOption,
    RobotArgument,
    ScenarioOption,
    SeedOption,
    TaskArgument,
)
from fulmar_bringup.console import output, print_json
from fulmar_bringup.node_table import RunPlan
from fulmar_bringup.progress import step_bar
from fulmar_core.episode import JUDGE_SEED, episode_steps
from fulmar_core.errors import UnknownNameError
from fulmar_core.metrics import Trajectories

WAYS = ("batch", "mujoco", "ros")
Progress = Callable[[int], None]


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
    episodes: Annotated[int, typer.Option(metavar="N", min=1, help="Number of episodes.")] = 256,
    seed: SeedOption = JUDGE_SEED,
    scenario: ScenarioOption = "nominal",
    control_hz: Annotated[
        float | None, typer.Option(metavar="HZ", min=0.01, help="Command rate; the robot's own by default.")
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, help="Pairs of processes through ros; one for each core."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Judge a controller over many episodes and print every figure.

    Episode i of a seed is the same in every way of running it. Success means staying inside the task's tolerance
    for its whole closing window.

    Try:

    fulmar evaluate floating_platform go_to_pose --controller lqr --through ros
    """
    from fulmar_bringup.extras import require
    from fulmar_bringup.planning import checked_rate, chosen_policy
    from fulmar_bringup.system import check_names, modules_of
    from fulmar_core.disturbances.scenario import load_scenario
    from fulmar_core.metrics import summary
    from fulmar_core.robot import load_robot
    from fulmar_core.tasks import load_task

    if through not in WAYS:
        raise UnknownNameError("way", through, WAYS)
    check_names(robot, task, controller, "mujoco")
    the_robot, the_task = load_robot(robot), load_task(task)
    load_scenario(scenario)  # so that a wrong name is told before anything is started
    hz = checked_rate(the_robot, control_hz or the_robot.timing.control_hz)
    policy = chosen_policy(controller, policy, the_robot, the_task, hz)
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
        lockstep=True,
    )
    began = time.monotonic()
    with step_bar("judging", episodes * episode_steps(the_task, 1.0 / hz)) as progress:
        run = _roll_out(plan, through, episodes, jobs or _cores(), progress)
    wall_s = time.monotonic() - began
    figures = {
        "robot": robot,
        "task": task,
        "controller": controller,
        "through": through,
        "scenario": scenario,
        "seed": seed,
        "control_hz": hz,
        **summary(run, the_task),
        "wall_s": wall_s,
        "steps_per_s": run.position_error.size / wall_s,
    }
    if as_json:
        print_json(figures)
    else:
        _print(figures)


def _roll_out(plan: RunPlan, through: str, episodes: int, jobs: int, progress: Progress) -> Trajectories:
    from fulmar_bringup.system import CONTROLLERS
    from fulmar_core.disturbances.scenario import load_scenario
    from fulmar_core.robot import load_robot
    from fulmar_core.rollout import roll_out_in_backends, roll_out_in_batch
    from fulmar_core.tasks import load_task

    if through == "ros":
        from fulmar_bringup.ros_evaluation import roll_out_through_ros

        return roll_out_through_ros(plan, episodes=episodes, jobs=jobs, progress=progress)
    robot, task, scenario = load_robot(plan.robot), load_task(plan.task), load_scenario(plan.scenario)
    controller = CONTROLLERS[plan.controller].load(robot, task, plan.control_hz, plan.policy)
    if through == "batch":
        return roll_out_in_batch(
            controller, robot, task, scenario, episodes=episodes, seed=plan.seed, progress=progress
        )
    from sim_nodes.mujoco_backend import MujocoBackend

    return roll_out_in_backends(
        controller,
        lambda: MujocoBackend(robot, sensor_noise=scenario.sensor_noise),
        task,
        scenario,
        episodes=episodes,
        seed=plan.seed,
        progress=progress,
    )


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
        if isinstance(value, dict):
            numbers = (
                "–" if value[key] is None else f"{value[key]:.3f}" for key in ("mean", "median", "p95")
            )
            table.add_row(name, *numbers)
    output.print(table)
    output.print(
        f"success {figures['success_rate']:.3f} of {figures['episodes']} episodes (seed {figures['seed']}) "
        f"through {figures['through']}; {figures['wall_s']:.1f} s, {figures['steps_per_s']:,.0f} steps/s"
    )
