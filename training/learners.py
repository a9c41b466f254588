"""The explicit table of learning algorithms: which settings build which learner of Stable-Baselines3."""

from __future__ import annotations

import numpy as np
from sb3_contrib import RecurrentPPO
from stable_baselines3 import PPO, SAC, TD3
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.noise import NormalActionNoise, VectorizedActionNoise
from stable_baselines3.common.vec_env import VecEnv

from training.behavior_cloning import Apprentice
from training.fast_ppo import FastPPO
from training.ppo import KlAdaptiveRate, KlFeedback, build_ppo
from training.settings import Algorithm, OnPolicy, Ppo, RecurrentPpo, Td3


def learner_class(settings: Algorithm) -> type[BaseAlgorithm]:
    """The class that settings build, which also loads what it has saved."""
    if isinstance(settings, Ppo):
        if settings.lessons:
            return Apprentice
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


def callbacks_of(learner: BaseAlgorithm) -> list[BaseCallback]:
    """Callbacks that a learner needs, whatever else it learns with."""
    rate = learner.learning_rate
    return [KlFeedback(rate)] if isinstance(rate, KlAdaptiveRate) else []
