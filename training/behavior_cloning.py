"""PPO that begins as the apprentice of a classical law.

For its first updates the policy moves towards what the law would do in the situations that the policy itself gets into
(DAgger without a mixture, Ross, Gordon and Bagnell 2011, arXiv 1011.0686), while the value learns from returns as
always. What follows is PPO, from a policy that knows its trade already.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Protocol

import gymnasium
import numpy as np
import torch
from torch.nn.utils import clip_grad_norm_

from fulmar_core.controllers.classical import load_classical
from fulmar_core.controllers.disturbance_inputs import PUSH_TERMS
from fulmar_core.controllers.law import Law
from fulmar_core.controllers.lqr import Lqr
from fulmar_core.controllers.wrench_choice import WrenchChoice
from fulmar_core.errors import ConfigError
from training.fast_ppo import FastPPO, rows
from training.vec_env import BatchVecEnv

RATE = (1e-3, 1e-4)  # learning rate of the first and of the last lesson
PASSES = 6.0  # through the samples, in each lesson
WEIGHT = 10.0  # of the squared error beside that of the value


class Apprentice(FastPPO):
    """`FastPPO` with a number of lessons before it, of which `training.behavior_cloning` says where there are any."""

    def __init__(self, *args: Any, lessons: int = 0, **more: Any) -> None:
        """Build it; see `PPO` for everything but the number of lessons."""
        self.lessons = lessons
        self._teacher: Teacher | None = None
        self._examples: list[np.ndarray] = []
        super().__init__(*args, **more)

    def _excluded_save_params(self) -> list[str]:
        return [*super()._excluded_save_params(), "_teacher", "_examples"]

    @property
    def lesson(self) -> int:
        """How many lessons there have been."""
        return min(self._n_updates // self.n_epochs, self.lessons)

    def _look(self) -> None:
        if self.lesson == self.lessons:
            return
        normaliser = self.get_vec_normalize_env()
        assert normaliser is not None
        if getattr(self, "_teacher", None) is None:
            worlds = normaliser.unwrapped
            assert isinstance(worlds, BatchVecEnv)
            self._teacher, self._examples = teacher_of(worlds), []
        assert self._teacher is not None
        self._examples.append(self._teacher.actions(np.asarray(normaliser.get_original_obs())))

    @torch.no_grad()
    def train(self) -> None:
        """A lesson, or an update of PPO."""
        if self.lesson == self.lessons:
            super().train()
            return
        self.policy.set_training_mode(True)
        first, last = RATE
        rate = first + (last - first) * self.lesson / max(1, self.lessons - 1)
        for group in self.policy.optimizer.param_groups:
            group["lr"] = rate
        samples = rows(self.rollout_buffer.observations), rows(self.rollout_buffer.returns)
        wanted = torch.from_numpy(np.concatenate(self._examples))
        self._examples.clear()
        errors = []
        for _ in range(round(PASSES * len(wanted) / self.batch_size)):
            chosen = torch.randint(len(wanted), (self.batch_size,))
            errors.append(self._follow(samples[0][chosen], wanted[chosen], samples[1][chosen]))
        self._n_updates += self.n_epochs
        self.logger.record("train/imitation_error", float(np.mean(errors)))

    def _follow(self, observations: torch.Tensor, wanted: torch.Tensor, returns: torch.Tensor) -> float:
        """One step of the optimiser; returns the mean squared error of the actions."""
        count = len(wanted)
        away = self._actor(observations) - wanted
        self._actor.backward(away * (2.0 * WEIGHT / count))
        surprise = self._critic(observations) - returns
        self._critic.backward(surprise * (2.0 * self.vf_coef / count))
        self.policy.log_std.grad = torch.zeros_like(self.policy.log_std)
        clip_grad_norm_(self.policy.parameters(), self.max_grad_norm)
        self.policy.optimizer.step()
        self._refresh()
        return float(away.square().mean())


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
        now = self._law.frame.situation(inputs)
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
