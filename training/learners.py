"""Learners of Stable-Baselines3 from our settings, and a learning rate that follows the KL divergence."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from sb3_contrib import RecurrentPPO
from stable_baselines3 import PPO, SAC, TD3
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.noise import NormalActionNoise, VectorizedActionNoise
from stable_baselines3.common.vec_env import VecEnv

from fulmar_core.dynamics.flight_trim import find_trim
from fulmar_core.robots.robot import Robot
from fulmar_core.states.counter_rng import Draws
from fulmar_core.tasks import Task
from training.behavior_cloning import BehaviorCloningPPO
from training.fast_ppo import FastPPO
from training.settings import Algorithm, OnPolicy, Ppo, RecurrentPpo, Td3


def learner_class(settings: Algorithm) -> type[BaseAlgorithm]:
    """The class that settings build, which also loads what it has saved."""
    if isinstance(settings, Ppo):
        if settings.cloning_updates:
            return BehaviorCloningPPO
        return FastPPO if settings.fast else PPO
    if isinstance(settings, RecurrentPpo):
        return RecurrentPPO
    return TD3 if isinstance(settings, Td3) else SAC


def build_learner(
    settings: Algorithm, env: VecEnv, *, seed: int, tensorboard: str | None = None
) -> BaseAlgorithm:
    """A learner over an environment.

    Args:
        settings: Hyper-parameters.
        env: Environment, usually normalised.
        seed: Seed of weights and action sampling.
        tensorboard: Folder for TensorBoard, or None.

    Returns:
        The learner; it must learn with `callbacks_of(learner)`.
    """
    if isinstance(settings, OnPolicy):
        assert isinstance(settings, Ppo | RecurrentPpo)
        return build_ppo(settings, env, seed=seed, tensorboard=tensorboard)
    more = {}
    if isinstance(settings, Td3):
        shape = env.action_space.shape
        assert shape is not None
        one = NormalActionNoise(np.zeros(shape), np.full(shape, settings.action_noise))
        more = {"action_noise": VectorizedActionNoise(one, env.num_envs)}
    return learner_class(settings)(
        "MlpPolicy",
        env,
        learning_rate=settings.learning_rate,
        buffer_size=settings.buffer,
        batch_size=settings.minibatch,
        learning_starts=settings.first_steps,
        train_freq=1,
        gradient_steps=settings.gradient_steps,
        tau=settings.tau,
        gamma=settings.gamma,
        policy_kwargs={"net_arch": list(settings.hidden)},
        tensorboard_log=tensorboard,
        seed=seed,
        device="cpu",
        **more,
    )


def first_action(robot: Robot, task: Task) -> np.ndarray | None:
    """Shares of full command that a learner begins around, shape (n,); None: those of no command.

    An aircraft begins in trim: without thrust every craft would be in the water before it has learned anything.
    """
    if robot.airframe is None:
        return None
    start, goal = task.draw(Draws.of_episode(0, 0), robot, training=True)
    # Where targets are no places, the height is that of the start.
    above = start.z[0] if task.goal_topic == "goal_velocity" else goal.targets[0, 0, 2]
    height = max(float(above), 0.1 * robot.airframe.span)
    return np.asarray(find_trim(robot, robot.airframe.speed, height).command / robot.actuators.scale)


def begin_near(learner: BaseAlgorithm, action: np.ndarray | None) -> None:
    """Let a new policy of an on-policy learner answer with about an action, whatever it observes."""
    last = getattr(learner.policy, "action_net", None)
    if action is not None and last is not None:
        with torch.no_grad():
            last.bias.copy_(torch.as_tensor(action, dtype=last.bias.dtype))


def callbacks_of(learner: BaseAlgorithm) -> list[BaseCallback]:
    """Callbacks that a learner needs, whatever else it learns with."""
    rate = learner.learning_rate
    return [KlFeedback(rate)] if isinstance(rate, KlAdaptiveRate) else []


class KlAdaptiveRate:
    """Learning rate that falls when updates go too far and rises when they do too little."""

    def __init__(self, settings: OnPolicy) -> None:
        self.rate = settings.learning_rate
        self._low, self._high = settings.learning_rate_range
        self.target = settings.target_kl  # divergence of an update

    def __call__(self, progress_remaining: float) -> float:
        """Current rate; how much of the run remains does not matter."""
        return self.rate

    def update(self, kl: float) -> None:
        """Move the rate by half again when the divergence is off by a factor of two."""
        if kl > 2.0 * self.target:
            self.rate = max(self.rate / 1.5, self._low)
        elif kl < 0.5 * self.target:
            self.rate = min(self.rate * 1.5, self._high)


class KlFeedback(BaseCallback):
    """Passes the divergence of the last update to the learning rate."""

    def __init__(self, rate: KlAdaptiveRate) -> None:
        super().__init__()
        self._rate = rate

    def _on_rollout_start(self) -> None:
        kl = self.logger.name_to_value.get("train/approx_kl")
        if kl is not None:
            self._rate.update(float(kl))

    def _on_step(self) -> bool:
        return True


def build_ppo(
    settings: Ppo | RecurrentPpo, env: VecEnv, *, seed: int, tensorboard: str | None = None
) -> PPO | RecurrentPPO:
    """PPO over an environment; it must learn with `KlFeedback(learner.learning_rate)`.

    Args:
        settings: Hyper-parameters.
        env: Environment, usually normalised.
        seed: Seed of weights and action sampling.
        tensorboard: Folder for TensorBoard, or None.
    """
    sizes = list(settings.hidden)
    policy: dict[str, Any] = {"net_arch": {"pi": sizes, "vf": sizes}, "activation_fn": torch.nn.Tanh}
    if isinstance(env.action_space, spaces.Box):
        policy["log_std_init"] = settings.log_std
    kind: type[PPO | RecurrentPPO] = PPO
    more: dict[str, Any] = {}
    if isinstance(settings, RecurrentPpo):
        kind = RecurrentPPO
        policy["lstm_hidden_size"] = settings.memory
    elif settings.fast:
        kind, more = FastPPO, {"precision": settings.precision}
        if settings.cloning_updates:
            kind, more = BehaviorCloningPPO, more | {"cloning_updates": settings.cloning_updates}
    return kind(
        "MlpLstmPolicy" if kind is RecurrentPPO else "MlpPolicy",
        env,
        learning_rate=KlAdaptiveRate(settings),
        n_steps=settings.steps,
        batch_size=settings.minibatch,
        n_epochs=settings.epochs,
        gamma=settings.gamma,
        gae_lambda=settings.gae_lambda,
        clip_range=settings.clip_range,
        max_grad_norm=settings.max_grad_norm,
        ent_coef=settings.entropy,
        policy_kwargs=policy,
        tensorboard_log=tensorboard,
        seed=seed,
        device="cpu",
        **more,
    )
