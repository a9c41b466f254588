"""The deployed half of a learner: normalisation and policy network, without anything that only training needs."""

from __future__ import annotations

import itertools
import pickle
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize
from torch import nn

from fulmar_core.errors import ConfigError
from fulmar_core.rotation import Array


class DeployedNetwork(nn.Module):
    """Observation in, logits and on/off command out; what `export` writes to ONNX."""

    def __init__(self, sizes: Sequence[int], *, limit: float) -> None:
        """Build an untrained network of tanh layers.

        Args:
            sizes: Number of observation terms, of units of each hidden layer, and of actuators.
            limit: Normalised observations are cut to this.
        """
        super().__init__()
        self.limit = limit
        self.register_buffer("mean", torch.zeros(sizes[0]))
        self.register_buffer("scale", torch.ones(sizes[0]))
        layers: list[nn.Module] = []
        for inputs, outputs in itertools.pairwise(sizes):
            layers += [nn.Linear(inputs, outputs), nn.Tanh()]
        self.layers = nn.Sequential(*layers[:-1])
        self.eval()

    @property
    def observation_count(self) -> int:
        """Number of terms it takes."""
        return int(self.mean.shape[0])

    mean: torch.Tensor
    scale: torch.Tensor

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

    def infer(self, observation: Array) -> tuple[np.ndarray, np.ndarray]:
        """Command and logits as NumPy, shapes as in `forward`."""
        with torch.inference_mode():
            command, logits = self(torch.as_tensor(np.asarray(observation, dtype=np.float32)))
        return command.numpy(), logits.numpy()


def deployed_network(learner: PPO, normaliser: VecNormalize) -> DeployedNetwork:
    """Copy a learner's present weights and statistics.

    Args:
        learner: A PPO with an MLP policy of tanh layers over on/off actuators.
        normaliser: Holds the running mean and variance of the observations.

    Returns:
        A network that shares nothing with the learner.
    """
    statistics = normaliser.obs_rms
    assert not isinstance(statistics, dict)
    trained = (*learner.policy.mlp_extractor.policy_net, learner.policy.action_net)
    linear = [layer for layer in trained if isinstance(layer, nn.Linear)]
    network = DeployedNetwork(
        [linear[0].in_features, *(layer.out_features for layer in linear)], limit=normaliser.clip_obs
    )
    network.mean.copy_(torch.as_tensor(statistics.mean, dtype=torch.float32))
    network.scale.copy_(torch.as_tensor(np.sqrt(statistics.var + normaliser.epsilon), dtype=torch.float32))
    twins = [layer for layer in network.layers if isinstance(layer, nn.Linear)]
    for twin, layer in zip(twins, linear, strict=True):
        twin.load_state_dict(layer.state_dict())
    return network


def save_network(network: DeployedNetwork, path: Path) -> None:
    """Write weights and statistics."""
    torch.save({"limit": network.limit, "state": network.state_dict()}, path)


def load_network(path: Path) -> DeployedNetwork:
    """Read what `save_network` wrote; tensors only, no pickled code.

    Raises:
        ConfigError: If the file holds anything else.
    """
    try:
        content = torch.load(path, weights_only=True)
        state = content["state"]
        weights = [value for name, value in state.items() if name.endswith("weight")]
        network = DeployedNetwork(
            [weights[0].shape[1], *(w.shape[0] for w in weights)], limit=content["limit"]
        )
        network.load_state_dict(state)
    except (
        OSError,
        EOFError,
        RuntimeError,
        pickle.UnpicklingError,
        LookupError,
        TypeError,
        AttributeError,
    ) as error:
        raise ConfigError(
            f"{path}: holds no weights that `fulmar train` wrote ({type(error).__name__})."
        ) from error
    return network


class NetworkController:
    """A network behind the controller interface, for evaluation while it learns."""

    name = "policy"

    def __init__(
        self, network: DeployedNetwork, observation_names: tuple[str, ...], control_hz: float
    ) -> None:
        """Wrap a network; rate in Hz."""
        self._network = network
        self.observation_names = observation_names
        self.control_hz = control_hz

    def reset(self) -> None:
        """Nothing to forget: the network has no memory."""

    def act(self, observation: Array) -> Array:
        """Choose actuators; shapes as in `Controller.act`."""
        command, _ = self._network.infer(np.atleast_2d(observation))
        return command.reshape((*np.shape(observation)[:-1], command.shape[-1]))

    def metadata(self) -> dict[str, Any]:
        """Its kind; an unfinished network has no identity worth recording."""
        return {"controller": self.name}
