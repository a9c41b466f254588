"""PPO of Stable-Baselines3 with an update and a rollout that two CPU cores compute quickly.

Same loss, same buffers, same files and callbacks; what differs is how it is computed:

- hidden layers in bfloat16 where the processor has it, output layers and all losses in float32;
- all samples in one matrix, shuffled once an epoch and cut into contiguous minibatches;
- values and log-probabilities of a rollout in one pass at its end, with the network that the update will use,
  so that the ratio of the first minibatch is exactly one;
- Adam in one fused step.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3 import PPO
from stable_baselines3.common.buffers import RolloutBuffer
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.utils import explained_variance
from stable_baselines3.common.vec_env import VecEnv
from torch.nn.functional import linear, mse_loss

from training.action_law import ActionLaw, action_law
from training.fast_mlp import fast_precision, tanh_stack


class FastPPO(PPO):
    """PPO for an `MlpPolicy` of separate tanh networks over MultiBinary or Box actions, on a CPU."""

    def _setup_model(self) -> None:
        self.policy_kwargs = {"activation_fn": torch.nn.Tanh, **self.policy_kwargs}
        self.policy_kwargs.setdefault("optimizer_kwargs", {"eps": 1e-5, "fused": True})
        super()._setup_model()
        self._precision = fast_precision()
        action_law(self.policy)  # refuses other action spaces

    @property
    def _law(self) -> ActionLaw:
        return action_law(self.policy)

    def _actor(self, observations: torch.Tensor) -> torch.Tensor:
        """Outputs of the policy network, shape (batch, m)."""
        hidden = tanh_stack(observations, self.policy.mlp_extractor.policy_net, self._precision)
        return linear(hidden, self.policy.action_net.weight, self.policy.action_net.bias)

    def _critic(self, observations: torch.Tensor) -> torch.Tensor:
        """Values, shape (batch,)."""
        hidden = tanh_stack(observations, self.policy.mlp_extractor.value_net, self._precision)
        return linear(hidden, self.policy.value_net.weight, self.policy.value_net.bias).flatten()

    def collect_rollouts(
        self, env: VecEnv, callback: BaseCallback, rollout_buffer: RolloutBuffer, n_rollout_steps: int
    ) -> bool:
        """Fill the buffer; returns False if the callback wants to stop."""
        assert self._last_obs is not None
        self.policy.set_training_mode(False)
        rollout_buffer.reset()
        callback.on_rollout_start()
        buffer, law, box = rollout_buffer, self._law, self.action_space
        cut: list[tuple[int, int, np.ndarray]] = []  # step, world and last observation of truncated episodes
        for step in range(n_rollout_steps):
            observations = np.asarray(self._last_obs, dtype=np.float32)
            with torch.no_grad():
                actions = law.sample(self._actor(torch.from_numpy(observations))).numpy()
            allowed = np.clip(actions, box.low, box.high) if isinstance(box, spaces.Box) else actions
            self._last_obs, rewards, dones, infos = env.step(allowed)
            self.num_timesteps += env.num_envs
            callback.update_locals(locals())
            if not callback.on_step():
                return False
            buffer.observations[step] = observations
            buffer.actions[step] = actions
            buffer.rewards[step] = rewards
            buffer.episode_starts[step] = self._last_episode_starts
            self._last_episode_starts = dones
            ended = np.flatnonzero(dones)
            self._update_info_buffer([infos[world] for world in ended], dones[ended])
            cut += [
                (step, world, infos[world]["terminal_observation"])
                for world in ended
                if infos[world].get("TimeLimit.truncated", False)
            ]
        buffer.pos, buffer.full = n_rollout_steps, True
        last_values = self._appraise(buffer, cut)
        buffer.compute_returns_and_advantage(last_values=last_values, dones=dones)
        callback.update_locals(locals())
        callback.on_rollout_end()
        return True

    @torch.no_grad()
    def _appraise(self, buffer: RolloutBuffer, cut: list[tuple[int, int, np.ndarray]]) -> torch.Tensor:
        """Fill in values and log-probabilities, and what truncated episodes would still have earned.

        Returns:
            Values of the observations after the last step, shape (worlds,).
        """
        observations, actions = _rows(buffer.observations), _rows(buffer.actions)
        buffer.values[:] = self._critic(observations).view(buffer.values.shape).numpy()
        log_probs = self._law.log_prob(self._actor(observations), actions)
        buffer.log_probs[:] = log_probs.view(buffer.log_probs.shape).numpy()
        if cut:
            steps, worlds, last = zip(*cut, strict=True)
            values = self._critic(torch.from_numpy(np.stack(last).astype(np.float32)))
            buffer.rewards[list(steps), list(worlds)] += self.gamma * values.numpy()
        return self._critic(torch.from_numpy(np.asarray(self._last_obs, dtype=np.float32)))

    def train(self) -> None:
        """Update policy and value from the buffer."""
        self.policy.set_training_mode(True)
        self._update_learning_rate(self.policy.optimizer)
        clip = self.clip_range(self._current_progress_remaining)
        buffer, law = self.rollout_buffer, self._law
        columns = [
            _rows(getattr(buffer, name))
            for name in ("observations", "actions", "log_probs", "advantages", "returns")
        ]
        widths = [column.shape[1] for column in columns]
        samples = torch.cat(columns, dim=1)
        for _ in range(self.n_epochs):
            shuffled = samples[torch.randperm(len(samples))]
            told: list[torch.Tensor] = []
            for minibatch in shuffled.split(self.batch_size):
                observations, actions, old, advantages, returns = minibatch.split(widths, dim=1)
                loss, figures = self._loss(
                    law, observations, actions, old.flatten(), advantages.flatten(), returns.flatten(), clip
                )
                self.policy.optimizer.zero_grad()
                loss.backward()
                torch.nn.utils.clip_grad_norm_(self.policy.parameters(), self.max_grad_norm)
                self.policy.optimizer.step()
                told.append(figures)
            self._n_updates += 1
        self._tell(torch.stack(told).mean(0), clip)

    def _loss(
        self,
        law: ActionLaw,
        observations: torch.Tensor,
        actions: torch.Tensor,
        old_log_prob: torch.Tensor,
        advantages: torch.Tensor,
        returns: torch.Tensor,
        clip: float,
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """The clipped loss of one minibatch, and figures about it: policy and value loss, KL, share clipped."""
        outputs = self._actor(observations)
        if self.normalize_advantage:
            std, mean = torch.std_mean(advantages)
            advantages = (advantages - mean) / (std + 1e-8)
        change = law.log_prob(outputs, actions) - old_log_prob
        ratio = change.exp()
        policy_loss = -torch.min(advantages * ratio, advantages * ratio.clamp(1 - clip, 1 + clip)).mean()
        value_loss = mse_loss(self._critic(observations), returns)
        loss = policy_loss + self.vf_coef * value_loss
        if self.ent_coef:
            loss = loss - self.ent_coef * law.entropy(outputs)
        with torch.no_grad():
            kl = (ratio - 1.0 - change).mean()
            clipped = ((ratio - 1.0).abs() > clip).float().mean()
            return loss, torch.stack((policy_loss, value_loss, kl, clipped))

    def _tell(self, figures: torch.Tensor, clip: float) -> None:
        names = ("policy_gradient_loss", "value_loss", "approx_kl", "clip_fraction")
        for name, value in zip(names, figures.tolist(), strict=True):
            self.logger.record(f"train/{name}", value)
        buffer: Any = self.rollout_buffer
        explained = explained_variance(buffer.values.flatten(), buffer.returns.flatten())
        self.logger.record("train/explained_variance", explained)
        if hasattr(self.policy, "log_std"):
            self.logger.record("train/std", self.policy.log_std.exp().mean().item())
        self.logger.record("train/n_updates", self._n_updates, exclude="tensorboard")
        self.logger.record("train/clip_range", clip)


def _rows(array: np.ndarray) -> torch.Tensor:
    """A buffer's array of steps and worlds as a matrix with one row for each sample, without copying."""
    return torch.from_numpy(array).view(array.shape[0] * array.shape[1], -1)
