"""PPO that begins by cloning a classical law.

For its first updates the policy moves towards the actions of the law in the states that the policy itself visits
(DAgger without a mixture, Ross, Gordon and Bagnell 2011, arXiv 1011.0686), while the value learns from returns as
always. PPO follows.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Protocol

import gymnasium
import numpy as np
import torch
from torch.nn.utils import clip_grad_norm_

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.classical import load_classical
from fulmar_core.controllers.disturbance_inputs import PUSH_TERMS
from fulmar_core.controllers.law import Law
from fulmar_core.controllers.lqr import Lqr
from fulmar_core.controllers.wrench_choice import WrenchChoice
from fulmar_core.controllers.wrench_shares import body_terms
from fulmar_core.states.attitude import scaled
from fulmar_core.states.rotation import Array
from training.fast_ppo import FastPPO, rows
from training.vec_env import BatchVecEnv

RATE = (1e-3, 1e-4)  # learning rate of the first and of the last cloning update
PASSES = 6.0  # through the samples, in each cloning update
WEIGHT = 10.0  # of the squared error of the actions beside that of the value


class BehaviorCloningPPO(FastPPO):
    """`FastPPO` whose first updates clone the law of the robot's family."""

    def __init__(self, *args: Any, cloning_updates: int = 0, **more: Any) -> None:
        self.cloning_updates = cloning_updates
        self._expert: Expert | None = None
        self._examples: list[np.ndarray] = []
        super().__init__(*args, **more)

    def _excluded_save_params(self) -> list[str]:
        return [*super()._excluded_save_params(), "_expert", "_examples"]

    @property
    def cloned(self) -> int:
        """Number of cloning updates that are done."""
        return min(self._n_updates // self.n_epochs, self.cloning_updates)

    def _look(self) -> None:
        if self.cloned == self.cloning_updates:
            return
        normaliser = self.get_vec_normalize_env()
        assert normaliser is not None
        if getattr(self, "_expert", None) is None:
            worlds = normaliser.unwrapped
            assert isinstance(worlds, BatchVecEnv)
            self._expert, self._examples = expert_of(worlds), []
        assert self._expert is not None
        self._examples.append(self._expert.actions(np.asarray(normaliser.get_original_obs())))

    @torch.no_grad()
    def train(self) -> None:
        """Do a cloning update, or an update of PPO."""
        if self.cloned == self.cloning_updates:
            super().train()
            return
        self.policy.set_training_mode(True)
        first, last = RATE
        rate = first + (last - first) * self.cloned / max(1, self.cloning_updates - 1)
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


class Expert(Protocol):
    """A classical law with its shipped gains, in the terms of a network's actions."""

    def actions(self, observations: np.ndarray) -> np.ndarray:
        """Actions of the law.

        Args:
            observations: From the worlds, not normalised, shape (worlds, n).

        Returns:
            Actions, each value within [-1, 1], shape (worlds, m).
        """
        ...


def expert_of(worlds: BatchVecEnv) -> Expert:
    """The law of the robot's family, for the worlds' robot and task.

    Raises:
        ConfigError: No law does the task, or the actions are single valves that open and close.
    """
    robot, task = worlds.robot, worlds.task
    law = load_classical(robot, task)
    if isinstance(law, Lqr):  # its observer remembers its own commands, but here the policy commands
        law = Lqr(robot, task, replace(law.gains, observer=None), control_hz=robot.timing.control_hz)
    if worlds.choice is not None and isinstance(law, Lqr):
        return WrenchExpert(law, worlds.choice, worlds)
    if worlds.bodies:
        return BodyExpert(worlds)
    if isinstance(worlds.action_space, gymnasium.spaces.Box) and worlds.choice is None:
        return CommandExpert(law, worlds)
    raise ConfigError(
        f"'cloning_updates': no law can be cloned where a network opens single valves, as for '{robot.name}' at "
        f"'{task.name}'. Set 'action_space: wrench', or leave 'cloning_updates' out."
    )


class WrenchExpert:
    """The LQR; it takes pushes from the network's disturbance inputs, where it has them, instead of an estimate."""

    def __init__(self, law: Lqr, choice: WrenchChoice, worlds: BatchVecEnv) -> None:
        self._law, self._choice, self._worlds = law, choice, worlds

    def actions(self, observations: np.ndarray) -> np.ndarray:
        """Shares of the wanted wrench; see `Expert`."""
        inputs = self._worlds.inputs()
        now = self._law.frame.body_state(inputs)
        if self._worlds.takes_disturbances:
            terms = inputs.observation.shape[1]
            now = replace(now, push=np.asarray(observations[:, terms : terms + len(PUSH_TERMS)], dtype=float))
        return np.asarray(self._choice.shares_of(self._law.wanted(inputs, now)), dtype=np.float32)


class BodyExpert:
    """The PD law in space, slower by the root of r for a body with a share r of the robot's acceleration.

    Where a target moves, or a velocity is wanted, every body follows as fast as the robot would.
    """

    def __init__(self, worlds: BatchVecEnv) -> None:
        robot = worlds.robot
        law: Any = load_classical(robot, worlds.task, law="pd")
        law.allocation = _Asked()
        self._law, self._worlds = law, worlds
        self._scales = not (law.frame.tracks or worlds.task.moves)
        self._own = body_terms(robot)
        self._mass = np.array([robot.body.mass] * 3 + list(robot.body.inertia[:3]))

    def actions(self, observations: np.ndarray) -> np.ndarray:
        """Shares of what each body can do; see `Expert`."""
        bodies, inputs = self._worlds.bodies, self._worlds.inputs()
        assert bodies is not None
        terms = np.broadcast_to(bodies.terms, (len(observations), len(self._own))).astype(float)
        share = np.ones_like(terms)
        if self._scales:
            ratios = (terms / self._own).reshape(-1, 2, 3).mean(axis=-1)
            share, (pace, turning) = np.repeat(ratios, 3, axis=1), np.sqrt(ratios.T)
            state: Any = inputs.state
            slowed = (*scaled(1.0 / pace, state.velocity), *scaled(1.0 / turning, state.rate))
            inputs = replace(inputs, state=type(state)(*state.position, *state.quat, *slowed))
        wanted = self._law.command(inputs) / self._mass * share / terms
        parts = wanted.reshape(-1, 2, 3)
        fitting = parts / np.maximum(1.0, np.abs(parts).max(axis=-1, keepdims=True))
        return np.asarray(fitting.reshape(-1, 6), dtype=np.float32)


class _Asked:
    """In the place of an allocation: gives the wrench itself."""

    def best(self, wanted: Array, alive: Array | None = None, dearer: Array | None = None) -> Array:
        """See `Allocation.best`."""
        return wanted


class CommandExpert:
    """A law whose commands, as shares of full command, are the network's actions."""

    def __init__(self, law: Law, worlds: BatchVecEnv) -> None:
        self._law, self._worlds = law, worlds
        self._scale = np.asarray(worlds.robot.actuators.scale, dtype=float)

    def actions(self, observations: np.ndarray) -> np.ndarray:
        """Shares of full command; see `Expert`."""
        shares = np.clip(self._law.act(self._worlds.inputs()) / self._scale, -1.0, 1.0)
        return self._worlds.answered(shares.astype(np.float32))
