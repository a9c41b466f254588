"""PPO of Stable-Baselines3, built from our settings, with a learning rate that follows the KL divergence."""

from __future__ import annotations

from typing import Any

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnv

from training.fast_ppo import FastPPO
from training.settings import PpoSettings


class KlAdaptiveRate:
    """Learning rate that falls when updates go too far and rises when they do too little."""

    def __init__(self, settings: PpoSettings) -> None:
        """Begin at the settings' rate."""
        self.rate = settings.learning_rate
        self._low, self._high = settings.learning_rate_range
        self._target = settings.target_kl

    def __call__(self, progress_remaining: float) -> float:
        """Current rate; how much of the run remains does not matter."""
        return self.rate

    def update(self, kl: float) -> None:
        """Move the rate by half again when the divergence is off by a factor of two."""
        if kl > 2.0 * self._target:
            self.rate = max(self.rate / 1.5, self._low)
        elif kl < 0.5 * self._target:
            self.rate = min(self.rate * 1.5, self._high)


class KlFeedback(BaseCallback):
    """Hands the divergence of the last update to the learning rate."""

    def __init__(self, rate: KlAdaptiveRate) -> None:
        """Remember whom to tell."""
        super().__init__()
        self._rate = rate

    def _on_rollout_start(self) -> None:
        kl = self.logger.name_to_value.get("train/approx_kl")
        if kl is not None:
            self._rate.update(float(kl))

    def _on_step(self) -> bool:
        return True


def build_ppo(
    settings: PpoSettings, env: VecEnv, *, seed: int, tensorboard: str | None = None, fast: bool = True
) -> tuple[PPO, KlFeedback]:
    """PPO over an environment.

    Args:
        settings: Hyper-parameters.
        env: Environment, usually normalised.
        seed: Seed of weights and action sampling.
        tensorboard: Folder for TensorBoard, or None.
        fast: Use our faster PPO, instead of Stable-Baselines3's own.

    Returns:
        The learner, and the callback it must learn with.
    """
    rate = KlAdaptiveRate(settings)
    net_arch: dict[str, Any] = {"pi": list(settings.hidden), "vf": list(settings.hidden)}
    learner = (FastPPO if fast else PPO)(
        "MlpPolicy",
        env,
        learning_rate=rate,
        n_steps=settings.steps,
        batch_size=settings.minibatch,
        n_epochs=settings.epochs,
        gamma=settings.gamma,
        gae_lambda=settings.gae_lambda,
        clip_range=settings.clip_range,
        max_grad_norm=settings.max_grad_norm,
        ent_coef=0.0,
        policy_kwargs={"net_arch": net_arch, "activation_fn": torch.nn.Tanh},
        tensorboard_log=tensorboard,
        seed=seed,
        device="cpu",
    )
    return learner, KlFeedback(rate)
