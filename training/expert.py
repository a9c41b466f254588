"""What a classical law would do, for networks that begin as its apprentices."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

import gymnasium
import numpy as np

from fulmar_core.controllers.classical import load_classical
from fulmar_core.controllers.disturbance_inputs import PUSH_TERMS
from fulmar_core.controllers.law import Law
from fulmar_core.controllers.lqr import Lqr
from fulmar_core.controllers.wrench_choice import WrenchChoice
from fulmar_core.errors import ConfigError
from training.vec_env import BatchVecEnv


class Teacher(Protocol):
    """A classical law with its shipped gains, in the terms of a network's actions."""

    def actions(self, observations: np.ndarray) -> np.ndarray:
        """What it would do.

        Args:
            observations: As the worlds give them, not normalised, shape (worlds, n).

        Returns:
            Actions, each value within [-1, 1], shape (worlds, m).
        """
        ...


def teacher_of(worlds: BatchVecEnv) -> Teacher:
    """The law of the robot's family, for the worlds' robot and task.

    Raises:
        ConfigError: No law does the task, or nobody can imitate what it does: single valves that open and close.
    """
    robot, task = worlds.robot, worlds.task
    law = load_classical(robot, task)
    if isinstance(law, Lqr):  # what it remembers is of its own past, and the past here is its apprentice's
        law = Lqr(robot, task, replace(law.gains, observer=None), control_hz=robot.timing.control_hz)
    if worlds.choice is not None and isinstance(law, Lqr):
        return WrenchTeacher(law, worlds.choice, worlds)
    if isinstance(worlds.action_space, gymnasium.spaces.Box) and worlds.choice is None:
        return CommandTeacher(law, worlds)
    raise ConfigError(
        f"'lessons': nobody can imitate valves that open and close, and a network for '{robot.name}' at '{task.name}' "
        "chooses each by itself. Set 'wrench: true', or leave 'lessons' out."
    )


class WrenchTeacher:
    """The LQR; where the network is told pushes, it takes them as told instead of estimating."""

    def __init__(self, law: Lqr, choice: WrenchChoice, worlds: BatchVecEnv) -> None:
        """Bind it to the worlds, and to what chooses valves for wrenches in them."""
        self._law, self._choice, self._worlds = law, choice, worlds

    def actions(self, observations: np.ndarray) -> np.ndarray:
        """Shares of the wanted wrench; see `Teacher`."""
        inputs = self._worlds.inputs()
        now = self._law.frame.body_state(inputs)
        if self._worlds.told:
            terms = inputs.observation.shape[1]
            now = replace(now, push=np.asarray(observations[:, terms : terms + len(PUSH_TERMS)], dtype=float))
        return np.asarray(self._choice.shares_of(self._law.wanted(inputs, now)), dtype=np.float32)


class CommandTeacher:
    """A law whose commands are what the network's actions are: shares of full command."""

    def __init__(self, law: Law, worlds: BatchVecEnv) -> None:
        """Bind it to the worlds and the scale of their actuators."""
        self._law, self._worlds = law, worlds
        self._scale = np.asarray(worlds.robot.actuators.scale, dtype=float)

    def actions(self, observations: np.ndarray) -> np.ndarray:
        """Shares of full command; see `Teacher`."""
        shares = np.clip(self._law.act(self._worlds.inputs()) / self._scale, -1.0, 1.0)
        return self._worlds.answered(shares.astype(np.float32))
