"""Closed loops without ROS: a controller in the core's batch, or in an independent simulator."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from fulmar_core.backend import Backend
from fulmar_core.controllers.controller import Controller
from fulmar_core.disturbances.scenario import Scenario
from fulmar_core.episode import draw_episode
from fulmar_core.metrics import Trajectories, TrajectoryLog, join
from fulmar_core.robot import Robot
from fulmar_core.simulation import BatchSimulation
from fulmar_core.tasks import Task

Progress = Callable[[int], None]  # called with the number of control steps done


def roll_out_in_batch(
    controller: Controller,
    robot: Robot,
    task: Task,
    scenario: Scenario,
    *,
    episodes: int,
    seed: int,
    progress: Progress = lambda steps: None,
) -> Trajectories:
    """Run episodes 0 to `episodes - 1` of a seed at once, in the core's own dynamics.

    Args:
        controller: Whom to judge.
        robot: The robot.
        task: The task.
        scenario: What episodes are drawn from.
        episodes: Number of episodes, >= 1.
        seed: Seed of the draws.
        progress: Told how many control steps have been done.

    Returns:
        What happened, from the true states.
    """
    simulation = BatchSimulation(
        robot, task, scenario, worlds=episodes, seed=seed, control_hz=controller.control_hz
    )
    controller.reset()
    log = TrajectoryLog(simulation.control_dt)
    for step in range(round(task.episode_s / simulation.control_dt)):
        command = robot.actuators.limited(controller.act(task.observe(simulation.measured, simulation.goal)))
        simulation.step(command)
        log.add(simulation.truth, simulation.goal, command)
        progress((step + 1) * episodes)
    return log.trajectories()


def roll_out_in_backend(
    controller: Controller,
    backend: Backend,
    task: Task,
    scenario: Scenario,
    *,
    episodes: int,
    seed: int,
    progress: Progress = lambda steps: None,
) -> Trajectories:
    """Run episodes 0 to `episodes - 1` of a seed one after the other in a backend; arguments as above."""
    robot = backend.robot
    substeps = robot.timing.substeps(controller.control_hz)
    control_dt = substeps * robot.timing.physics_dt
    steps = round(task.episode_s / control_dt)
    runs = []
    for number in range(episodes):
        episode = draw_episode(robot, task, scenario, seed=seed, number=number)
        sample = backend.reset(episode.start, episode.world, seed=seed, number=number)
        controller.reset()
        log = TrajectoryLog(control_dt)
        for _ in range(steps):
            command = robot.actuators.limited(controller.act(task.observe(sample.odometry, episode.goal)))
            sample = backend.step(command, substeps)
            assert sample.truth is not None, "only a simulator can be judged"
            log.add(sample.truth, episode.goal, np.asarray(command))
        runs.append(log.trajectories())
        progress((number + 1) * steps)
    return join(runs)
