"""Closed loops without ROS: a controller in the core's batch, or in simulators side by side."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import Protocol

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.controller import Controller, Readings
from fulmar_core.dynamics.things import Poses
from fulmar_core.estimators.readings import readings_of
from fulmar_core.loop.control_loop import ControlLoop, readings_for
from fulmar_core.loop.newest_readings import NewestReadings
from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.backend import Backend, Sample
from fulmar_core.simulation.episode import Alter, draw_episodes, episode_steps
from fulmar_core.simulation.metrics import TargetCounter, Trajectories, TrajectoryLog, join
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.rotation import Array
from fulmar_core.states.state import State
from fulmar_core.tasks import Task
from fulmar_core.tasks.goal import Goal, goal_in_float64
from fulmar_core.worlds.scenario import Scenario

SIDE_BY_SIDE = 256  # simulators alive at once
WORLDS = 2048  # of a batch at once: nearly as fast as more, and their record stays below some 200 MB

Progress = Callable[[int], None]  # called with the number of control steps done
# What cameras of robots in some true states see, shapes (n,): images by the name of their reading, each (n, ...).
Sight = Callable[[State, Poses], Readings]


def roll_out_in_batch(
    controller: Controller,
    robot: Robot,
    task: Task,
    scenario: Scenario,
    *,
    episodes: int,
    seed: int,
    progress: Progress = lambda steps: None,
    sight: Sight | None = None,
) -> Trajectories:
    """Run episodes in the core's own dynamics; arguments and errors as in `batches`, their runs in one."""
    runs = batches(
        controller, robot, task, scenario, episodes=episodes, seed=seed, progress=progress, sight=sight
    )
    return join(list(runs))


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
    sight: Sight | None = None,
    first: int = 0,
    alter: Alter | None = None,
) -> Iterator[Trajectories]:
    """Run some episodes of a seed in the core's own dynamics, some at once.

    Args:
        controller: The controller.
        robot: The robot.
        task: The task.
        scenario: What episodes are drawn from.
        episodes: Number of episodes, >= 1.
        seed: Seed of the draws.
        worlds: How many run at once, >= 1; what happens does not depend on it.
        progress: Receives the number of control steps done.
        sight: The robots' cameras.
        first: Number of the first episode, >= 0.
        alter: Changes the episodes, as in `draw_episodes`.

    Yields:
        What happened, from the true states, for the next so many episodes.

    Raises:
        ConfigError: An episode is shorter than one control step, or the controller sees and there is no `sight`.
    """
    _check_sight(controller, robot, sight)
    for done in range(0, episodes, worlds):
        count = min(worlds, episodes - done)
        simulation = BatchSimulation(
            robot,
            task,
            scenario,
            worlds=count,
            seed=seed,
            first=first + done,
            control_hz=controller.control_hz,
            alter=alter,
        )
        before = done * episode_steps(task, simulation.control_dt)

        def further(steps: int, before: int = before) -> None:
            progress(before + steps)

        yield _roll_out(controller, robot, task, simulation, simulation.goal, further, sight)


def roll_out_in_backends(
    controller: Controller,
    make_backend: Callable[[], Backend],
    task: Task,
    scenario: Scenario,
    *,
    episodes: int,
    seed: int,
    progress: Progress = lambda steps: None,
    sight: Sight | None = None,
    first: int = 0,
    alter: Alter | None = None,
) -> Trajectories:
    """Run some episodes of a seed, each in a backend of its own, stepped side by side.

    Args:
        controller: The controller.
        make_backend: Builds one simulator.
        task: The task.
        scenario: What episodes are drawn from.
        episodes: Number of episodes, >= 1.
        seed: Seed of the draws.
        progress: Receives the number of control steps done.
        sight: The robots' cameras.
        first: Number of the first episode, >= 0.
        alter: Changes the episodes, as in `draw_episodes`.

    Returns:
        What happened, from the true states.

    Raises:
        ConfigError: An episode is shorter than one control step, or the controller sees and there is no `sight`.
    """
    runs: list[Trajectories] = []
    with ExitStack() as stack:
        backends = []
        for _ in range(min(episodes, SIDE_BY_SIDE)):
            backends.append(make_backend())
            stack.callback(backends[-1].close)
        for number in range(0, episodes, SIDE_BY_SIDE):
            numbers = range(first + number, first + min(number + SIDE_BY_SIDE, episodes))
            done = sum(run.position_error.size for run in runs)

            def further(steps: int, done: int = done) -> None:
                progress(done + steps)

            robot = backends[0].robot
            _check_sight(controller, robot, sight)
            drawn = draw_episodes(
                robot, task.fitted(robot), scenario, seed=seed, numbers=np.asarray(numbers), alter=alter
            )
            samples = [
                backend.reset(drawn[i], seed=seed, number=each)
                for i, (backend, each) in enumerate(zip(backends, numbers, strict=False))
            ]
            worlds = SteppedBackends(backends, samples, controller, task)
            runs.append(_roll_out(controller, robot, task, worlds, drawn.goal, further, sight))
    return join(runs)


class _Worlds(Protocol):
    """Worlds that are stepped side by side: the core's batch, or as many simulators."""

    @property
    def measured(self) -> State:
        """Odometry now, shapes (worlds,)."""
        ...

    @property
    def truth(self) -> State:
        """True state now, shapes (worlds,)."""
        ...

    @property
    def things(self) -> Poses:
        """Where the task's things are, each (worlds, 3)."""
        ...

    @property
    def readings(self) -> Readings:
        """What else is measured, see `Inputs.readings`."""
        ...

    def move(self, command: Array) -> None:
        """Apply commands within every limit for one control step, shape (worlds, n)."""
        ...


def _check_sight(controller: Controller, robot: Robot, sight: Sight | None) -> None:
    """Refuse a controller that sees where there is no camera.

    Raises:
        ConfigError: With what to do.
    """
    known = readings_of(robot)
    seen = [name for name in controller.readings if name in known and known[name].image]
    if seen and sight is None:
        raise ConfigError(
            f"controller '{controller.name}' takes the reading '{seen[0]}', and there is no camera here. Evaluate it "
            "with --through mujoco, which draws what it sees."
        )


def _roll_out(
    controller: Controller,
    robot: Robot,
    task: Task,
    worlds: _Worlds,
    goal: Goal,
    progress: Progress,
    sight: Sight | None,
) -> Trajectories:
    """Run one episode in each world; what happened is taken from the true states."""
    loop = ControlLoop(robot, task, controller, robots=len(goal.done))
    log, counter = TrajectoryLog(robot, loop.task, loop.dt), TargetCounter(loop.task, goal, loop.dt)
    loop.reset()
    loop.begin(goal_in_float64(goal))
    for number in range(episode_steps(task, loop.dt)):
        assert loop.goal is not None
        loop.goal = goal_in_float64(loop.goal.among(worlds.things))
        readings = (
            worlds.readings if sight is None else {**worlds.readings, **sight(worlds.truth, worlds.things)}
        )
        step = loop.step(worlds.measured, readings, round(1e9 * number * loop.dt))
        worlds.move(step.command)
        log.add(worlds.truth, counter.update(worlds.truth, worlds.things), step.command)
        progress((number + 1) * len(goal.done))
    return log.trajectories()


class SteppedBackends:
    """Simulators that are stepped side by side."""

    def __init__(
        self, backends: list[Backend], samples: list[Sample], controller: Controller, task: Task
    ) -> None:
        self._backends, self._form, self._ns = backends, task.state_type, 0
        robot = backends[0].robot
        self._substeps = robot.timing.substeps(controller.control_hz)
        self._step_ns = round(1e9 * self._substeps * robot.timing.physics_dt)
        taken = readings_for(robot, task, [controller])
        self._newest = [NewestReadings(robot, taken, in_step=True) for _ in samples]
        self._take(samples)

    def move(self, command: Array) -> None:
        """Apply commands for one control step."""
        self._ns += self._step_ns
        stepped = zip(self._backends, command, strict=False)
        self._take([backend.step(each, self._substeps) for backend, each in stepped])

    def _take(self, samples: list[Sample]) -> None:
        form = self._form
        self.measured = form.stack([form.from_rigid(sample.measured) for sample in samples])
        self.truth = form.stack([form.from_rigid(each.truth) for each in samples if each.truth is not None])
        self.things = {name: np.stack([each.things[name] for each in samples]) for name in samples[0].things}
        for newest, sample in zip(self._newest, samples, strict=True):
            for name in newest.kinds.keys() & sample.readings.keys():
                reading = sample.readings[name]
                newest.take(name, reading, reading.stamp(self._ns))
        each = [newest.at(self._ns) for newest in self._newest]
        self.readings = {
            name: np.concatenate([one[name] for one in each])
            for name in each[0]
            if all(name in one for one in each)
        }
