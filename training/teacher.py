"""What the LQR would ask for, for networks that ask for wrenches."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fulmar_core.controllers.classical import load_classical
from fulmar_core.controllers.lqr import Lqr
from fulmar_core.controllers.situation import raw_situation
from fulmar_core.controllers.told import PUSH_TERMS
from fulmar_core.controllers.wrench_choice import WrenchChoice
from fulmar_core.errors import ConfigError
from training.vec_env import BatchVecEnv


class Teacher:
    """The LQR with its shipped gains; where the network is told pushes, it takes them as told instead of estimating."""

    def __init__(self, worlds: BatchVecEnv) -> None:
        """Build the law for the worlds' robot and task.

        Raises:
            ConfigError: These worlds take no wrenches, or there is no LQR for their task.
        """
        robot, task = worlds.robot, worlds.task
        law = load_classical(robot, task, law="lqr")
        if worlds.choice is None or not isinstance(law, Lqr):
            raise ConfigError(
                f"'lessons': what is imitated is the wrench that an LQR asks for, and a network for '{robot.name}' at "
                f"'{task.name}' asks for none. Set 'wrench: true', or leave 'lessons' out."
            )
        self._choice: WrenchChoice = worlds.choice
        self._law = Lqr(robot, task, replace(law.gains, observer=None), control_hz=robot.timing.control_hz)
        self._told = worlds.told

    def actions(self, observations: np.ndarray) -> np.ndarray:
        """What it would do.

        Args:
            observations: As the worlds give them, not normalised, shape (worlds, n).

        Returns:
            Shares of the wanted wrench, shape (worlds, 3).
        """
        seen = np.asarray(observations, dtype=float)
        terms = len(self._law.observation_names)
        now = raw_situation(self._law.reader, seen[:, :terms])
        if self._told:
            now = replace(now, push=seen[:, terms : terms + len(PUSH_TERMS)])
        return np.asarray(self._choice.shares_of(self._law.wanted(seen[:, :terms], now)), dtype=np.float32)
