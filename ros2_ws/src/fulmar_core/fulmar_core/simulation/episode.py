"""Episodes: everything that is drawn before the first step, reproducible by seed and number.

Episode i of a seed is the same in the core's batch, in MuJoCo and through ROS, whatever the batch size.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.dynamics.by_kind import begin_of, dynamics_of
from fulmar_core.robots.robot import Robot
from fulmar_core.states.counter_rng import START, WORLD, Draws
from fulmar_core.states.state import S
from fulmar_core.tasks import Task
from fulmar_core.tasks.goal import Goal
from fulmar_core.worlds.scenario import Scenario
from fulmar_core.worlds.world import World

# Numbers of episodes, shape (n,), their starts, goals and worlds: the same, changed. Starts are as the task draws them.
Alter = Callable[[np.ndarray, Any, Goal, Any], tuple[Any, Goal, Any]]


@dataclass(frozen=True, slots=True)
class Episode(Generic[S]):
    """Where an episode starts, what it is about, and in which world; or many episodes at once."""

    start: S
    goal: Goal
    world: World
    command: np.ndarray | None = (
        None  # that actuators begin with, shape (n,) or (episodes, n); None: the safe one
    )

    def __getitem__(self, index: int) -> Episode:
        """One episode out of many."""
        command = None if self.command is None else self.command[index]
        return Episode(self.start[index], self.goal[index], self.world[index], command)


def episode_steps(task: Task, control_dt: float) -> int:
    """Control steps of one episode, >= 1.

    Raises:
        ConfigError: The episode is shorter than one control step [s].
    """
    steps = round(task.episode_s / control_dt)
    if steps < 1:
        raise ConfigError(
            f"an episode of task '{task.name}' lasts {task.episode_s:g} s, less than one control step of "
            f"{control_dt:g} s. Use a higher rate or a longer episode."
        )
    return steps


def draw_episodes(
    robot: Robot,
    task: Task,
    scenario: Scenario,
    *,
    seed: int,
    numbers: np.ndarray,
    repeats: np.ndarray | None = None,
    training: bool = False,
    alter: Alter | None = None,
) -> Episode:
    """Draw episodes.

    Args:
        robot: The robot.
        task: Says where episodes start and what they are about.
        scenario: Says what may differ.
        seed: Seed of the run, >= 0.
        numbers: Numbers of the episodes, or of the worlds they run in, shape (n,), >= 0.
        repeats: How many episodes each of these worlds has had before, shape (n,); none by default.
        training: Start where learning starts instead of where evaluation does.
        alter: Changes what was drawn, before actuators begin; the scenario's largest values still bound it.

    Returns:
        As many episodes.

    Raises:
        ConfigError: The robot cannot have this scenario.
    """
    if scenario.body == "morphology" and robot.morphology is None:
        raise ConfigError(
            f"scenario '{scenario.title}' has 'body: morphology', and the file of '{robot.name}' has no 'morphology' "
            "to draw bodies from. Add one, or take another scenario or robot."
        )
    numbers = np.asarray(numbers)
    repeats = np.zeros_like(numbers) if repeats is None else repeats
    start, goal = task.draw(Draws(seed, numbers, repeats, START), robot, training=training)
    world = dynamics_of(robot).draw_world(scenario, Draws(seed, numbers, repeats, WORLD))
    if alter is not None:
        start, goal, world = alter(numbers, start, goal, world)
    start, command = begin_of(robot).in_world(robot, start, world)
    return Episode(start, goal, world, command)


def draw_episode(robot: Robot, task: Task, scenario: Scenario, *, seed: int, number: int) -> Episode:
    """Draw one episode, without a batch axis; arguments as in `draw_episodes`."""
    return draw_episodes(robot, task, scenario, seed=seed, numbers=np.array([number]))[0]
