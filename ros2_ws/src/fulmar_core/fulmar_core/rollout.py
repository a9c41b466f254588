"""Closed loops without ROS: a controller in the core's batch, or in an independent simulator."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import numpy as np

from fulmar_core.backend import Backend, Sample
from fulmar_core.controllers.controller import Controller
from fulmar_core.disturbances.scenario import Scenario
from fulmar_core.episode import draw_episodes, episode_steps
from fulmar_core.metrics import Judge, Trajectories, TrajectoryLog, join
from fulmar_core.observation import Observer, slewed
from fulmar_core.planar import planar_of, stack_planar
from fulmar_core.robot import Robot
from fulmar_core.simulation import BatchSimulation
from fulmar_core.tasks import Task, fitted

SIDE_BY_SIDE = 256  # simulators alive at once
WORLDS = 2048  # of a batch at once: nearly as fast as more, and their record stays below some 200 MB

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
    """Run episodes in the core's own dynamics; arguments and errors as in `batches`, their runs in one."""
    return join(
        list(batches(controller, robot, task, scenario, episodes=episodes, seed=seed, progress=progress))
    )


def batches(
    controller: Controller,
    robot: Robot,
    task: Task,
    scenario: Scenario,
    *,
    episodes: int,
    seed: int,
    worlds: int = WORLDS,
    progress: Progress = lambda steps: None,
) -> Iterator[Trajectories]:
    """Run some episodes of a seed in the core's own dynamics, some at once.

    Args:
        controller: Whom to judge.
        robot: The robot.
        task: The task.
        scenario: What episodes are drawn from.
        episodes: Number of episodes, >= 1.
        seed: Seed of the draws.
        worlds: How many run at once, >= 1; what happens does not depend on it.
        progress: Told how many control steps have been done.

    Yields:
        What happened, from the true states, for the next so many episodes.

    Raises:
        ConfigError: An episode is shorter than one control step.
    """
    for done in range(0, episodes, worlds):
        count = min(worlds, episodes - done)
        simulation = BatchSimulation(
            robot,
            task,
            scenario,
            worlds=count,
            seed=seed,
            first=done,
            control_hz=controller.control_hz,
        )
        dt = simulation.control_dt
        controller.reset()
        log, judge = TrajectoryLog(robot, task, dt), Judge(task, simulation.goal, dt)
        steps = episode_steps(task, dt)
        for step in range(steps):
            action = np.asarray(controller.act(simulation.observe()))
            simulation.step(action)
            log.add(simulation.truth, judge.see(simulation.truth, simulation.goal.block), simulation.command)
            progress(done * steps + (step + 1) * count)
        yield log.trajectories()


def roll_out_in_backends(
    controller: Controller,
    make_backend: Callable[[], Backend],
    task: Task,
    scenario: Scenario,
    *,
    episodes: int,
    seed: int,
    progress: Progress = lambda steps: None,
) -> Trajectories:
    """Run some episodes of a seed, each in a backend of its own, stepped side by side.

    Args:
        controller: Whom to judge.
        make_backend: Builds one simulator.
        task: The task.
        scenario: What episodes are drawn from.
        episodes: Number of episodes, >= 1.
        seed: Seed of the draws.
        progress: Told how many control steps have been done.

    Returns:
        What happened, from the true states.

    Raises:
        ConfigError: An episode is shorter than one control step.
    """
    runs: list[Trajectories] = []
    with ExitStack() as stack:
        backends = []
        for _ in range(min(episodes, SIDE_BY_SIDE)):
            backends.append(make_backend())
            stack.callback(backends[-1].close)
        for number in range(0, episodes, SIDE_BY_SIDE):
            numbers = range(number, min(number + SIDE_BY_SIDE, episodes))
            done = sum(run.position_error.size for run in runs)

            def further(steps: int, done: int = done) -> None:
                progress(done + steps)

            runs.append(_side_by_side(controller, backends, task, scenario, numbers, seed, further))
    return join(runs)


def _side_by_side(
    controller: Controller,
    backends: list[Backend],
    task: Task,
    scenario: Scenario,
    numbers: range,
    seed: int,
    progress: Progress,
) -> Trajectories:
    robot = backends[0].robot
    task = fitted(task, robot)
    substeps = robot.timing.substeps(controller.control_hz)
    control_dt = substeps * robot.timing.physics_dt
    drawn = draw_episodes(robot, task, scenario, seed=seed, numbers=np.asarray(numbers))
    samples = [
        backend.reset(drawn[i], seed=seed, number=number)
        for i, (backend, number) in enumerate(zip(backends, numbers, strict=False))
    ]
    count = len(samples)
    observer = Observer(robot, task)
    controller.reset()
    goal, command = drawn.goal, np.tile(robot.actuators.safe_command, (count, 1))
    log, judge = TrajectoryLog(robot, task, control_dt), Judge(task, drawn.goal, control_dt)
    for step in range(episode_steps(task, control_dt)):
        measured, block = stack_planar([planar_of(sample.measured) for sample in samples]), _blocks(samples)
        if block is not None:
            goal = dataclasses.replace(goal, block=block)
        goal = task.advance(goal, measured, np.asarray(step * control_dt)) if step else goal
        action = np.asarray(controller.act(observer(measured, goal, command)))
        command = slewed(robot.actuators.limited(action), command, robot, control_dt)
        samples = [backend.step(each, substeps) for backend, each in zip(backends, command, strict=False)]
        truth = stack_planar([planar_of(sample.truth) for sample in samples if sample.truth is not None])
        log.add(truth, judge.see(truth, _blocks(samples)), command)
        progress((step + 1) * count)
    return log.trajectories()


def _blocks(samples: list[Sample]) -> np.ndarray | None:
    """Where the things to push are, shape (samples, 2); None where there are none [m]."""
    places = [sample.block for sample in samples if sample.block is not None]
    return np.stack(places) if len(places) == len(samples) else None
