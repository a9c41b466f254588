"""PPO of Stable-Baselines3 with an update and a rollout that a CPU computes quickly.

Same loss, same buffer, same files, policies and callbacks; what differs is how it is computed:

- hidden layers in bfloat16 if asked for, output layers and all losses in float32;
- gradients written out, since PyTorch's bookkeeping costs as much as the arithmetic of such small networks;
- all samples in one matrix, shuffled once an epoch and cut into contiguous minibatches;
- values and log-probabilities of a rollout in one pass at its end, by the very network that the update begins
  with, so that the first ratio is one in bfloat16 too.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3 import PPO
from stable_baselines3.common.buffers import RolloutBuffer
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.utils import explained_variance
from stable_baselines3.common.vec_env import VecEnv
from torch import nn
from torch.nn.utils import clip_grad_norm_

from training.action_law import ActionLaw, action_law
from training.settings import Precision

_COLUMNS = ("observations", "actions", "log_probs", "advantages", "returns")


class FastPPO(PPO):
    """PPO for an `MlpPolicy` of separate tanh networks over MultiBinary, MultiDiscrete or Box actions, on a CPU."""

    def __init__(self, *args: Any, precision: Precision = "float32", **more: Any) -> None:
        """Build it; see `PPO` for everything but what concerns hidden layers.

        Args:
            args: Of `PPO`.
            precision: Number type that they are computed in.
            more: Of `PPO`.
        """
        self.precision = precision
        super().__init__(*args, **more)

    def _setup_model(self) -> None:
        self.policy_kwargs = {
            "activation_fn": torch.nn.Tanh,
            "optimizer_kwargs": {"eps": 1e-5, "fused": True},
            **self.policy_kwargs,
        }
        super()._setup_model()
        self._networks()  # refuses other policies

    def _excluded_save_params(self) -> list[str]:
        return [*super()._excluded_save_params(), "_actor", "_critic", "_law"]

    def _networks(self) -> None:
        policy, precision = self.policy, getattr(torch, self.precision)
        self._law: ActionLaw = action_law(policy)
        self._actor = FastMlp(policy.mlp_extractor.policy_net, policy.action_net, precision)
        self._critic = FastMlp(policy.mlp_extractor.value_net, policy.value_net, precision)

    def _refresh(self) -> None:
        self._actor.refresh()
        self._critic.refresh()

    def collect_rollouts(
        self, env: VecEnv, callback: BaseCallback, rollout_buffer: RolloutBuffer, n_rollout_steps: int
    ) -> bool:
        """Fill the buffer; returns False if the callback wants to stop."""
        assert self._last_obs is not None
        self.policy.set_training_mode(False)
        self._refresh()  # weights may have been loaded since the last update
        rollout_buffer.reset()
        callback.on_rollout_start()
        buffer, box = rollout_buffer, self.action_space
        cut: list[tuple[int, int, np.ndarray]] = []  # step, world and last observation of truncated episodes
        outputs: list[torch.Tensor] = []
        for step in range(n_rollout_steps):
            self._look()
            observations = np.asarray(self._last_obs, dtype=np.float32)
            outputs.append(self._actor(torch.from_numpy(observations)))
            with torch.no_grad():
                actions = self._law.sample(outputs[-1]).numpy()
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
        last_values = self._appraise(buffer, torch.cat(outputs), cut)
        buffer.compute_returns_and_advantage(last_values=last_values, dones=dones)
        callback.update_locals(locals())
        callback.on_rollout_end()
        return True

    def _look(self) -> None:
        """Hook before each step of a rollout."""

    @torch.no_grad()
    def _appraise(
        self, buffer: RolloutBuffer, outputs: torch.Tensor, cut: list[tuple[int, int, np.ndarray]]
    ) -> torch.Tensor:
        """Fill in values and log-probabilities, and what truncated episodes would still have earned.

        Args:
            buffer: Filled but for that.
            outputs: Of the policy network, one row for each sample.
            cut: Step, world and last observation of each truncated episode.

        Returns:
            Values of the observations after the last step, shape (worlds,).
        """
        values = self._critic(rows(buffer.observations))
        buffer.values[:] = values.view(buffer.values.shape).numpy()
        log_probs = self._law.log_prob(outputs, rows(buffer.actions))
        buffer.log_probs[:] = log_probs.view(buffer.log_probs.shape).numpy()
        if cut:
            steps, worlds, last = zip(*cut, strict=True)
            values = self._critic(torch.from_numpy(np.stack(last).astype(np.float32))).flatten()
            buffer.rewards[list(steps), list(worlds)] += self.gamma * values.numpy()
        return self._critic(torch.from_numpy(np.asarray(self._last_obs, dtype=np.float32))).flatten()

    @torch.no_grad()
    def train(self) -> None:
        """Update policy and value from the buffer."""
        self.policy.set_training_mode(True)
        self._update_learning_rate(self.policy.optimizer)
        clip = self.clip_range(self._current_progress_remaining)
        columns = [rows(getattr(self.rollout_buffer, name)) for name in _COLUMNS]
        widths = [column.shape[1] for column in columns]
        samples = torch.cat(columns, dim=1)
        figures: list[torch.Tensor] = []
        for _ in range(self.n_epochs):
            shuffled = samples.index_select(0, torch.randperm(len(samples)))
            figures = [
                self._learn_from(*minibatch.split(widths, dim=1), clip)
                for minibatch in shuffled.split(self.batch_size)
            ]
            self._n_updates += 1
        self._record(torch.stack(figures).mean(0), clip)

    def _learn_from(
        self,
        observations: torch.Tensor,
        actions: torch.Tensor,
        old_log_probs: torch.Tensor,
        advantages: torch.Tensor,
        returns: torch.Tensor,
        clip: float,
    ) -> torch.Tensor:
        """One step of the optimiser.

        Args:
            observations: Normalised, shape (batch, n).
            actions: As drawn, shape (batch, m).
            old_log_probs: Of the actions when they were drawn, shape (batch, 1), as all that follow.
            advantages: How much better than expected they turned out.
            returns: What the values should have been.
            clip: How far a ratio of probabilities may be from one.

        Returns:
            Policy loss, value loss, KL divergence (estimator k3, joschu.net/blog/kl-approx.html), share clipped.
        """
        old_log_probs, advantages = old_log_probs.flatten(), advantages.flatten()
        if self.normalize_advantage:
            std, mean = torch.std_mean(advantages)
            advantages = (advantages - mean) / (std + 1e-8)
        outputs, surprise = self._actor(observations), self._critic(observations) - returns
        change = self._law.log_prob(outputs, actions) - old_log_probs
        ratio = change.exp()
        gain = advantages * ratio
        clipped_gain = advantages * ratio.clamp(1.0 - clip, 1.0 + clip)
        # The smaller of the two is maximised; where it is the clipped one, it does not depend on the weights.
        weights = torch.where(gain <= clipped_gain, gain, 0.0).mul_(-1.0 / len(gain))
        self._actor.backward(self._law.backward(outputs, actions, weights, -self.ent_coef))
        self._critic.backward(surprise * (2.0 * self.vf_coef / len(gain)))
        clip_grad_norm_(self.policy.parameters(), self.max_grad_norm)
        self.policy.optimizer.step()
        self._refresh()
        return torch.stack(
            (
                -torch.min(gain, clipped_gain).mean(),
                surprise.square().mean(),
                (ratio - 1.0 - change).mean(),
                ((ratio - 1.0).abs() > clip).float().mean(),
            )
        )

    def _record(self, figures: torch.Tensor, clip: float) -> None:
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


def rows(array: np.ndarray) -> torch.Tensor:
    """A buffer's array of steps and worlds as a matrix with one row for each sample, without copying."""
    return torch.from_numpy(array).view(array.shape[0] * array.shape[1], -1)


class FastMlp:
    """The same function as `nn.Sequential(*hidden, head)`, and its gradient, over the same weights.

    Hidden layers are computed in `precision`, the head in float32. Weights are read anew by `refresh`.
    """

    def __init__(self, hidden: Iterable[nn.Module], head: nn.Linear, precision: torch.dtype) -> None:
        """Take the layers of a policy.

        Raises:
            ValueError: If the hidden layers are anything else.
        """
        layers = list(hidden)
        self._linear, between = layers[::2], layers[1::2]
        if len(self._linear) != len(between) or not all(isinstance(layer, nn.Tanh) for layer in between):
            raise ValueError("each hidden layer must be linear, followed by tanh")
        self._head, self.precision = head, precision
        self._in_one_pass = _in_one_pass(precision)
        self._hidden: list[torch.Tensor] = []
        self.refresh()

    @torch.no_grad()
    def refresh(self) -> None:
        """Read the weights, after an optimiser has changed them."""
        self._weights = [
            (layer.weight.to(self.precision), layer.bias.to(self.precision)) for layer in self._linear
        ]

    @torch.no_grad()
    def __call__(self, inputs: torch.Tensor) -> torch.Tensor:
        """Outputs for a batch of inputs: shapes (batch, n) and (batch, m), float32."""
        self._hidden = [inputs.to(self.precision)]
        for weight, bias in self._weights:
            self._hidden.append(self._layer(self._hidden[-1], weight, bias))
        self._features = self._hidden[-1].float()
        return torch.addmm(self._head.bias, self._features, self._head.weight.t())

    def _layer(self, inputs: torch.Tensor, weight: torch.Tensor, bias: torch.Tensor) -> torch.Tensor:
        if self._in_one_pass:
            return torch.ops.mkldnn._linear_pointwise(inputs, weight, bias, "tanh", [], "")
        return torch.addmm(bias, inputs, weight.t()).tanh_()

    @torch.no_grad()
    def backward(self, gradient: torch.Tensor) -> None:
        """Leave the weights' gradients in their `grad`.

        Args:
            gradient: Of the loss with respect to the outputs of the last call, shape (batch, m), float32.
        """
        _leave(self._head, gradient.t() @ self._features, gradient.sum(0))
        gradient = (gradient @ self._head.weight).to(self.precision)
        for layer in reversed(range(len(self._linear))):
            gradient = torch.ops.aten.tanh_backward(gradient, self._hidden[layer + 1])
            _leave(
                self._linear[layer],
                (gradient.t() @ self._hidden[layer]).float(),
                gradient.sum(0, dtype=torch.float32),
            )
            if layer > 0:
                gradient = gradient @ self._weights[layer][0]


def _leave(layer: nn.Linear, weight: torch.Tensor, bias: torch.Tensor) -> None:
    layer.weight.grad, layer.bias.grad = weight, bias


def _in_one_pass(precision: torch.dtype) -> bool:
    """Whether oneDNN computes product, sum and tanh together here: tanh alone costs twice the product.

    It has bfloat16 from AVX-512 on alone.
    """
    if not torch.backends.mkldnn.is_available():
        return False
    return precision != torch.bfloat16 or bool(torch.ops.mkldnn._is_mkldnn_bf16_supported())
