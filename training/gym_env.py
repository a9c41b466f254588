"""Gymnasium environments over the core's batch: one world (`TaskEnv`), and many that step together (`TaskVectorEnv`).

They need neither torch nor Stable-Baselines3; `training.environments` registers them with Gymnasium.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.tasks import Task
from fulmar_core.worlds.scenario import Scenario
from training.worlds import Worlds, actuator_space, observation_space

Infos = dict[str, Any]


class TaskEnv(gymnasium.Env[np.ndarray, np.ndarray]):
    """One world of a robot at a task; observations, rewards and endings are those of `BatchVecEnv`."""

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - Gymnasium's own type

    def __init__(
        self, robot: Robot, task: Task, scenario: Scenario, *, seed: int = 0, training: bool = True
    ) -> None:
        """Build the world.

        Args:
            robot: The robot.
            task: Gives observation, reward and episode length.
            scenario: What episodes are drawn from.
            seed: Seed of the episodes until `reset` receives another, >= 0.
            training: Start episodes where learning starts (`training_distance` of the task).
        """
        self._world = Worlds(robot, task, scenario, worlds=1, seed=seed, training=training)
        self.observation_space = observation_space(self._world.terms)
        self.action_space = actuator_space(robot)
        self._fresh = True  # the first episode has not been handed out yet

    @property
    def simulation(self) -> BatchSimulation:
        """The world, a batch of one."""
        return self._world.simulation

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, Infos]:
        """Begin an episode.

        Args:
            seed: Begin with the first episode of this seed; without it, with the next one.
            options: None are known.

        Returns:
            First observation, shape (terms,), and an empty dictionary.

        Raises:
            ConfigError: An option is given.
        """
        refuse(options)
        super().reset(seed=seed)
        if seed is not None:
            self._world.begin(seed)
        elif not self._fresh:
            self._world.begin_next(np.array([0]))
        self._fresh = False
        return self._world.observe()[0], {}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, Infos]:
        """Move one control step; returns observation, reward, terminated, truncated and an empty dictionary."""
        observation, reward, terminated, truncated = self._world.step(np.asarray(action)[None])
        return observation[0], float(reward[0]), bool(terminated[0]), bool(truncated[0]), {}


class TaskVectorEnv(gymnasium.vector.VectorEnv[np.ndarray, np.ndarray, np.ndarray]):
    """Many worlds of a robot at a task that step together, at the speed of the core's batch.

    A world whose episode is over begins the next one in the same step (`AutoresetMode.SAME_STEP`): the last observation
    of each stands in `infos["final_obs"]`, shape (worlds, terms), where `infos["_final_obs"]` is true.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - Gymnasium's own type
        "render_modes": [],
        "autoreset_mode": AutoresetMode.SAME_STEP,
    }

    def __init__(
        self,
        robot: Robot,
        task: Task,
        scenario: Scenario,
        *,
        num_envs: int = 1,
        seed: int = 0,
        training: bool = True,
    ) -> None:
        """Build the worlds.

        Args:
            robot: The robot.
            task: Gives observation, reward and episode length.
            scenario: What episodes are drawn from.
            num_envs: Number of worlds, >= 1.
            seed: Seed of the episodes until `reset` receives another, >= 0.
            training: Start episodes where learning starts (`training_distance` of the task).
        """
        self.num_envs = num_envs
        self._worlds = Worlds(robot, task, scenario, worlds=num_envs, seed=seed, training=training)
        self.single_observation_space = observation_space(self._worlds.terms)
        self.single_action_space = actuator_space(robot)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._fresh = True  # the first episodes have not been handed out yet

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, Infos]:
        """Begin an episode in every world; arguments, results and errors as in `TaskEnv.reset`."""
        refuse(options)
        super().reset(seed=seed)
        if seed is not None:
            self._worlds.begin(seed)
        elif not self._fresh:
            self._worlds.begin_next(np.arange(self.num_envs))
        self._fresh = False
        return self._worlds.observe(), {}

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, Infos]:
        """Move every world one control step; returns observations, rewards, terminated, truncated and infos."""
        seen, reward, terminated, truncated = self._worlds.step(actions)
        done = terminated | truncated
        if not done.any():
            return seen, reward, terminated, truncated, {}
        ended = np.flatnonzero(done)
        infos = {"final_obs": seen, "_final_obs": done}
        self._worlds.begin_next(ended)
        seen = seen.copy(order="K")
        seen[ended] = self._worlds.observe(ended)
        return seen, reward, terminated, truncated, infos


def refuse(options: dict[str, Any] | None) -> None:
    """Raise ConfigError if `reset` receives options; None and an empty dictionary are none."""
    if options:
        raise ConfigError(
            f"reset: unknown option '{next(iter(options))}': there are none. "
            "Choose robot, scenario and seed in gymnasium.make."
        )
