"""One world as a Gymnasium environment, for libraries that take no vector environments."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np

from fulmar_core.disturbances.scenario import Scenario
from fulmar_core.robot import Robot
from fulmar_core.tasks import Task
from training.vec_env import BatchVecEnv


class SingleEnv(gymnasium.Env[np.ndarray, np.ndarray]):
    """A batch of one: the same spaces, rewards and endings as `BatchVecEnv` has."""

    def __init__(
        self, robot: Robot, task: Task, scenario: Scenario, *, seed: int = 0, training: bool = True
    ) -> None:
        """Build the world.

        Args:
            robot: The robot.
            task: Gives observation, reward and episode length.
            scenario: What episodes are drawn from.
            seed: Seed of the episodes until `reset` is given another.
            training: Start episodes where learning starts.
        """
        self._batch = BatchVecEnv(
            robot, task, scenario, worlds=1, seed=seed, training=training, staggered=False
        )
        self.observation_space = self._batch.observation_space
        self.action_space = self._batch.action_space
        self._waiting = True  # an episode has begun that no reset has handed out yet

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode.

        Args:
            seed: Begin with the first episode of this seed; without it, with the next one.
            options: None are known.

        Returns:
            First observation, and nothing more.
        """
        super().reset(seed=seed)
        if seed is not None:
            self._batch.seed(seed)
            self._batch.reset()
        elif not self._waiting:
            self._batch.begin_anew([0])
        self._waiting = False
        return np.asarray(self._batch.simulation.observe())[0], {}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Move one control step; returns observation, reward, terminated, truncated and nothing more."""
        observation, reward, done, infos = self._batch.step(np.asarray(action)[None])
        self._waiting = bool(done[0])  # the batch begins again by itself
        truncated = bool(infos[0].get("TimeLimit.truncated", False))
        if done[0]:
            observation = np.asarray(infos[0]["terminal_observation"])[None]
        return observation[0], float(reward[0]), bool(done[0]) and not truncated, truncated, {}
