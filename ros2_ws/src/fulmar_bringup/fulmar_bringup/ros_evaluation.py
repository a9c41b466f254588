"""Judging a controller through the nodes it is deployed with: the plant here, the controller in its own process.

Plant and controller are the very nodes of `fulmar run`, in lock step over DDS. Only the truth is read directly from
the simulator, as no deployed node may.
"""

from __future__ import annotations

import os
import secrets
import time
from collections.abc import Callable
from dataclasses import replace

import rclpy
from rclpy.lifecycle import TransitionCallbackReturn

from fulmar_bringup.node_table import RunPlan, controller_spec, plant_spec
from fulmar_bringup.processes import ProcessGroup, command_line
from fulmar_bringup.supervisor import START_TIMEOUT_S, Supervisor, supervisor
from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.episode import draw_episode
from fulmar_core.errors import RunFailed
from fulmar_core.metrics import Trajectories, TrajectoryLog, join
from fulmar_core.robot import load_robot
from fulmar_core.tasks import load_task
from fulmar_ros.plant_node import PlantNode
from fulmar_ros.runtime import spinning
from sim_nodes.sim_node import make_backend

Progress = Callable[[int], None]


def roll_out_through_ros(
    plan: RunPlan, *, episodes: int, progress: Progress = lambda steps: None
) -> Trajectories:
    """Run episodes 0 to `episodes - 1` of the plan's seed one after the other.

    Args:
        plan: Robot, task, controller, backend, rate and seed; its start and duration do not matter.
        episodes: Number of episodes, >= 1.
        progress: Told how many control steps have been done.

    Returns:
        What happened, from the true states.

    Raises:
        RunFailed: The controller ended or refused to start.
        LockstepError: It did not answer in time.
    """
    # A domain of its own: nobody else's nodes can mix in.
    domain = os.environ.get("ROS_DOMAIN_ID") or str(1 + secrets.randbelow(100))
    os.environ["ROS_DOMAIN_ID"] = domain
    group = ProcessGroup()
    try:
        group.start(controller_spec(plan, subscribers=1))
        with supervisor(plan.robot, load_task(plan.task)) as overseer:
            arguments = command_line(plant_spec(replace(plan, supervised=True)))[3:]
            plant = PlantNode(make_backend, lambda _code: None, cli_args=arguments)
            if plant.trigger_configure() != TransitionCallbackReturn.SUCCESS:
                raise RunFailed("the plant could not be configured")
            with spinning(plant, overseer.fail):
                return _episodes(plan, plant, overseer, group, episodes, progress)
    finally:
        group.stop_all()
        rclpy.try_shutdown()


def _episodes(
    plan: RunPlan,
    plant: PlantNode,
    overseer: Supervisor,
    group: ProcessGroup,
    episodes: int,
    progress: Progress,
) -> Trajectories:
    robot, task, scenario = load_robot(plan.robot), load_task(plan.task), load_scenario(plan.scenario)
    control_dt = robot.timing.substeps(plan.control_hz) * robot.timing.physics_dt
    steps = round(task.episode_s / control_dt)
    runs: list[Trajectories] = []

    began = time.monotonic()

    def alive() -> None:
        end = group.ended()
        if end is not None:
            raise RunFailed(f"{end.text}; its own words are above")
        if time.monotonic() - began > START_TIMEOUT_S:
            raise RunFailed(
                f"the controller did not take its goal within {START_TIMEOUT_S:g} s. Try `fulmar doctor`."
            )

    for number in range(episodes):
        began = time.monotonic()
        episode = draw_episode(robot, task, scenario, seed=plan.seed, number=number)
        # The same instant twice would be the same goal: the clock moves on between episodes.
        plant.clock.advance(control_dt)
        overseer.give_goal(episode.goal, time_ns=plant.clock.now_ns, alive=alive)
        log = TrajectoryLog(control_dt)
        plant.run_episode(
            episode,
            number=number,
            seed=plan.seed,
            steps=steps,
            on_step=lambda sample, command, log=log, goal=episode.goal: log.add(sample.truth, goal, command),
        )
        runs.append(log.trajectories())
        progress((number + 1) * steps)
    return join(runs)
