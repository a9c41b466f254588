"""The deployed half of a learner: normalisation and policy network, without anything that only training needs."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from fulmar_core.rotation import Array
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize
from torch import nn


class DeployedNetwork(nn.Module):
    """Observation in, logits and on/off command out; what `export` writes to ONNX."""

    def __init__(self, learner: PPO, normaliser: VecNormalize) -> None:
        """Copy the present weights and statistics.

        Args:
            learner: A PPO with an MLP policy over on/off actuators.
            normaliser: Holds the running mean and variance of the observations.
        """
        super().__init__()
        statistics = normaliser.obs_rms
        assert not isinstance(statistics, dict)
        self.limit = float(normaliser.clip_obs)
        self.register_buffer("mean", torch.as_tensor(statistics.mean, dtype=torch.float32).clone())
        scale = np.sqrt(statistics.var + normaliser.epsilon)
        self.register_buffer("scale", torch.as_tensor(scale, dtype=torch.float32).clone())
        layers = [_copy(layer) for layer in (*learner.policy.mlp_extractor.policy_net, learner.policy.action_net)]
        self.layers = nn.Sequential(*layers)
        self.eval()

    def forward(self, observation: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Choose the more likely state of each actuator.

        Args:
            observation: Raw terms, shape (worlds, n).

        Returns:
            Command of zeros and ones, and the logits behind it, both of shape (worlds, m).
        """
        normal = torch.clamp((observation - self.mean) / self.scale, -self.limit, self.limit)
        logits = self.layers(normal)
        return (logits > 0.0).to(torch.float32), logits


class NetworkController:
    """A network behind the controller interface, for evaluation while it learns."""

    name = "policy"

    def __init__(self, network: DeployedNetwork, observation_names: tuple[str, ...], control_hz: float) -> None:
        """Wrap a network; rate in Hz."""
        self._network = network
        self.observation_names = observation_names
        self.control_hz = control_hz

    def reset(self) -> None:
        """Nothing to forget: the network has no memory."""

    def act(self, observation: Array) -> Array:
        """Choose actuators; shapes as in `Controller.act`."""
        with torch.inference_mode():
            batch = torch.as_tensor(np.atleast_2d(np.asarray(observation, dtype=np.float32)))
            command = self._network(batch)[0].numpy()
        return command.reshape((*np.shape(observation)[:-1], command.shape[-1]))

    def metadata(self) -> dict[str, Any]:
        """Its kind; an unfinished network has no identity worth recording."""
        return {"controller": self.name}


def _copy(layer: nn.Module) -> nn.Module:
    if not isinstance(layer, nn.Linear):
        return type(layer)()
    twin = nn.Linear(layer.in_features, layer.out_features)
    twin.load_state_dict(layer.state_dict())
    return twin
