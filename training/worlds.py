"""Worlds of one robot at one task, with the spaces of their observations and actions; no learning library."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.episode import episode_steps
from fulmar_core.simulation.learning_step import observed_step
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.tasks import Task
from fulmar_core.tasks.go_to_pose import GoToPose
from fulmar_core.worlds.scenario import Scenario

# Observations, rewards, terminated and truncated of each world.
Outcome = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


class Worlds:
    """Worlds of one robot at one task, and how long their episodes have lasted.

    An episode is terminated when the robot leaves the geofence or touches an obstacle, and truncated when its time
    (`episode_s` of the task) is up.

    Attributes:
        simulation: The worlds; built anew by `begin`.
    """

    def __init__(
        self, robot: Robot, task: Task, scenario: Scenario, *, worlds: int, seed: int, training: bool
    ) -> None:
        """Build the worlds; arguments as in `TaskVectorEnv`.

        Raises:
            ConfigError: There are no worlds, or the seed is negative.
        """
        if worlds < 1:
            raise ConfigError(f"num_envs: found {worlds}, need at least 1.")
        if seed < 0:
            raise ConfigError(f"seed: found {seed}, need 0 or more.")
        self._robot, self._task, self._scenario = robot, training_task(task, scenario), scenario
        self._worlds, self._training = worlds, training
        self._scale = np.asarray(robot.actuators.scale, dtype=np.float32)
        self.begin(seed)
        self._horizon = episode_steps(task, self.simulation.control_dt)

    @property
    def terms(self) -> int:
        """Number of observation terms."""
        return len(self.simulation.observer.names)

    def begin(self, seed: int) -> None:
        """Begin the first episode of a seed (>= 0) in every world."""
        self.simulation = BatchSimulation(
            self._robot, self._task, self._scenario, worlds=self._worlds, seed=seed, training=self._training
        )
        self._age = np.zeros(self._worlds, dtype=int)

    def begin_next(self, worlds: np.ndarray) -> None:
        """Begin the next episode in some worlds, by their numbers."""
        self.simulation.reset(worlds)
        self._age[worlds] = 0

    def observe(self, worlds: np.ndarray | None = None) -> np.ndarray:
        """Observations of some worlds, of all by default, shape (worlds, terms)."""
        return np.asarray(self.simulation.observe(worlds))

    def step(self, actions: np.ndarray) -> Outcome:
        """Move one control step; actions of shape (worlds, actuators) are elements of `actuator_space`."""
        command = np.asarray(actions, dtype=np.float32) * self._scale
        reward, over, seen = observed_step(self.simulation, command, effort=self._robot.costs.effort)
        self._age += 1
        terminated = np.asarray(over)
        truncated = (self._age >= self._horizon) & ~terminated
        return np.asarray(seen), np.asarray(reward), terminated, truncated


def observation_space(terms: int) -> gymnasium.spaces.Box:
    """Unbounded float32 vector of so many observation terms."""
    return gymnasium.spaces.Box(-np.inf, np.inf, (terms,), np.float32)


def actuator_space(robot: Robot) -> gymnasium.Space[Any]:
    """One entry for each actuator: 0 or 1 for on/off valves, else a share of the full command in [-1, 1]."""
    count = len(robot.actuators.names)
    return gymnasium.spaces.MultiBinary(count) if robot.actuators.binary else shares_space(count)


def shares_space(count: int) -> gymnasium.spaces.Box:
    """So many shares in [-1, 1], float32."""
    return gymnasium.spaces.Box(-1.0, 1.0, (count,), np.float32)


def training_task(task: Task, scenario: Scenario) -> Task:
    """The task with its reward for a scenario: another one where every failure makes the robot uncontrollable.

    Where no mean wrench is left in some direction (`fulmar_core.worlds.holdability`), a platform that turns its working
    nozzles towards where it brakes can still come to rest at its goal. A reward for the heading on the way keeps it
    from learning that.
    """
    if not (scenario.actuation.stranding and isinstance(task, GoToPose)):  # word: YAML key of scenarios
        return task
    weights = task.stranded_weights  # word: YAML key of tasks
    return replace(task, reward_weights=weights) if weights else task
