"""What a classical law would do, for networks that begin as its apprentices."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

import gymnasium
import numpy as np

from fulmar_core.controllers.classical import load_classical
from fulmar_core.controllers.law import Law
from fulmar_core.controllers.lqr import Lqr
from fulmar_core.controllers.situation import raw_situation
from fulmar_core.controllers.told import PUSH_TERMS
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
        return WrenchTeacher(law, worlds.choice, told=worlds.told)
    if isinstance(worlds.action_space, gymnasium.spaces.Box) and worlds.choice is None:
        return CommandTeacher(law, worlds)
    raise ConfigError(
        f"'lessons': nobody can imitate valves that open and close, and a network for '{robot.name}' at '{task.name}' "
        "chooses each by itself. Set 'wrench: true', or leave 'lessons' out."
    )


class WrenchTeacher:
    """The LQR; where the network is told pushes, it takes them as told instead of estimating."""

    def __init__(self, law: Lqr, choice: WrenchChoice, *, told: bool) -> None:
        """Bind it to what chooses valves for wrenches."""
        self._law, self._choice, self._told = law, choice, told

    def actions(self, observations: np.ndarray) -> np.ndarray:
        """Shares of the wanted wrench; see `Teacher`."""
        seen = np.asarray(observations, dtype=float)
        terms = len(self._law.observation_names)
        now = raw_situation(self._law.reader, seen[:, :terms])
        if self._told:
            now = replace(now, push=seen[:, terms : terms + len(PUSH_TERMS)])
        return np.asarray(self._choice.shares_of(self._law.wanted(seen[:, :terms], now)), dtype=np.float32)


class CommandTeacher:
    """A law whose commands are what the network's actions are: shares of full command."""

    def __init__(self, law: Law, worlds: BatchVecEnv) -> None:
        """Bind it to the scale of the worlds' actuators."""
        self._law = law
        self._scale = np.asarray(worlds.robot.actuators.scale, dtype=float)

    def actions(self, observations: np.ndarray) -> np.ndarray:
        """Shares of full command; see `Teacher`."""
        seen = np.asarray(observations, dtype=float)[:, : len(self._law.observation_names)]
        return np.clip(self._law.act(seen) / self._scale, -1.0, 1.0).astype(np.float32)
