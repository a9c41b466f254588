"""Judging a controller through the nodes it is deployed with: the plant here, the controller in its own process.

Plant and controller are the very nodes of `fulmar run`, in lock step over DDS. Only the truth is read directly from
the simulator, as no deployed node may.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
import time
from collections.abc import Callable
from concurrent.futures import FIRST_EXCEPTION, ProcessPoolExecutor, wait
from dataclasses import replace
from typing import Any

import numpy as np
from rclpy.lifecycle import TransitionCallbackReturn

from fulmar_bringup.domains import reserved_domains
from fulmar_bringup.node_table import RunPlan, controller_spec, plant_spec
from fulmar_bringup.processes import ProcessGroup, command_line
from fulmar_bringup.supervisor import START_TIMEOUT_S, Supervisor, supervisor
from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.episode import draw_episode
from fulmar_core.errors import RunFailed
from fulmar_core.metrics import Trajectories, TrajectoryLog, join, select
from fulmar_core.robot import load_robot
from fulmar_core.tasks import load_task
from fulmar_ros.plant_node import PlantNode
from fulmar_ros.runtime import SWITCH_INTERVAL_S, spinning
from sim_nodes.sim_node import make_backend

Progress = Callable[[int], None]


def roll_out_through_ros(
    plan: RunPlan, *, episodes: int, jobs: int, progress: Progress = lambda steps: None
) -> Trajectories:
    """Run episodes 0 to `episodes - 1` of the plan's seed, several side by side.

    A lock-stepped pair of processes keeps about one core busy, since one always waits for the other; so as many
    pairs as there are cores run at once, each in a ROS domain of its own. The episodes do not depend on how many.

    Args:
        plan: Robot, task, controller, backend, rate and seed; its start and duration do not matter.
        episodes: Number of episodes, >= 1.
        jobs: Number of pairs, >= 1.
        progress: Told how many control steps have been done.

    Returns:
        What happened, from the true states.

    Raises:
        RunFailed: The controller ended or refused to start.
        LockstepError: It did not answer in time.
    """
    jobs = min(jobs, episodes)
    shares = [range(first, episodes, jobs) for first in range(jobs)]
    spawn = multiprocessing.get_context("spawn")  # a fork would copy threads of DDS that do not survive it
    counts = [spawn.Value("q", 0) for _ in shares]
    with reserved_domains(jobs) as domains, ProcessPoolExecutor(jobs, spawn, _take_counts, (counts,)) as pool:
        futures = [
            pool.submit(_roll_out_share, plan, share, domain, index)
            for index, (share, domain) in enumerate(zip(shares, domains, strict=True))
        ]
        while not all(future.done() for future in futures):
            wait(futures, timeout=0.2, return_when=FIRST_EXCEPTION)
            progress(sum(count.value for count in counts))
        runs = [future.result() for future in futures]
    return _in_order(runs, shares)


_counts: list[Any] = []


def _take_counts(counts: list[Any]) -> None:
    """Keep the shared counters in a worker; they can only be handed over when it starts."""
    _counts[:] = counts


def _in_order(runs: list[Trajectories], shares: list[range]) -> Trajectories:
    numbers = np.concatenate([np.asarray(share) for share in shares])
    return select(join(runs), np.argsort(numbers))


def _roll_out_share(plan: RunPlan, numbers: range, domain: int, index: int) -> Trajectories:
    """Run some of the episodes with one pair of processes."""
    os.environ["ROS_DOMAIN_ID"] = str(domain)
    sys.setswitchinterval(SWITCH_INTERVAL_S)

    def progress(steps: int) -> None:
        _counts[index].value = steps

    group = ProcessGroup()
    try:
        group.start(controller_spec(plan, subscribers=1))
        with supervisor(plan.robot, load_task(plan.task)) as overseer:
            arguments = command_line(plant_spec(replace(plan, supervised=True)))[3:]
            plant = PlantNode(make_backend, lambda _code: None, cli_args=arguments)
            if plant.trigger_configure() != TransitionCallbackReturn.SUCCESS:
                raise RunFailed("the plant could not be configured")
            with spinning(plant, overseer.fail):
                return _episodes(plan, plant, overseer, group, numbers, progress)
    finally:
        group.stop_all()


def _episodes(
    plan: RunPlan,
    plant: PlantNode,
    overseer: Supervisor,
    group: ProcessGroup,
    numbers: range,
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

    for done, number in enumerate(numbers, start=1):
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
        progress(done * steps)
    return join(runs)
