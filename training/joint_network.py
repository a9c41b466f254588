"""One network for several tasks: its file, its growth by a task, and the network of a single task within it."""

from __future__ import annotations

import pickle
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecNormalize

from fulmar_core.config.atomic_write import whole_file
from fulmar_core.config.errors import ConfigError
from training.deploy import deployed_network
from training.joint_worlds import JointInputs
from training.network import DeployedNetwork
from training.vec_env import BatchVecEnv

_FIRST_LAYERS = ("mlp_extractor.policy_net.0.weight", "mlp_extractor.value_net.0.weight")


@dataclass(frozen=True)
class JointNetwork:
    """Policy and value of several tasks.

    Attributes:
        inputs: What it is given.
        weights: State of the policy of Stable-Baselines3.
        statistics: Mean and variance of each task's observation terms, shape (2, terms), float64.
    """

    inputs: JointInputs
    weights: Mapping[str, torch.Tensor]
    statistics: Mapping[str, torch.Tensor]

    @classmethod
    def of(
        cls, learner: BaseAlgorithm, inputs: JointInputs, parts: Mapping[str, VecNormalize]
    ) -> JointNetwork:
        """Copy a learner's present weights, and the statistics of its tasks."""
        weights = {name: value.clone() for name, value in learner.policy.state_dict().items()}
        return cls(inputs, weights, {task: _statistics_of(part) for task, part in parts.items()})

    def begin(self, learner: BaseAlgorithm) -> None:
        """Give a new learner the weights of the tasks so far; columns of further inputs stay as they were drawn."""
        grown = learner.policy.state_dict()
        for name, value in self.weights.items():
            if name in _FIRST_LAYERS:
                grown[name][:, : value.shape[1]] = value
            elif name != "log_std":  # a further task has to be explored anew
                grown[name] = value
        learner.policy.load_state_dict(grown)

    def save(self, path: Path) -> None:
        """Write it as one file, which replaces an older one only when it is complete."""
        content = {
            "names": list(self.inputs.names),
            "terms": {task: list(names) for task, names in (self.inputs.terms or {}).items()},
            "weights": dict(self.weights),
            "statistics": dict(self.statistics),
        }
        with whole_file(path) as file:
            torch.save(content, file)

    @classmethod
    def load(cls, path: Path) -> JointNetwork:
        """Read what `save` wrote; tensors and names only, no pickled code.

        Raises:
            ConfigError: If the file is missing or holds anything else.
        """
        try:
            content = torch.load(path, weights_only=True)
            terms = {task: tuple(names) for task, names in content["terms"].items()}
            inputs = JointInputs(tuple(content["names"]), terms)
            return cls(inputs, dict(content["weights"]), dict(content["statistics"]))
        except (OSError, EOFError, RuntimeError, pickle.UnpicklingError, LookupError, TypeError) as error:
            raise ConfigError(
                f"{path}: holds no network of several tasks ({type(error).__name__}). Begin again in another folder."
            ) from error


def network_of_task(
    learner: BaseAlgorithm, inputs: JointInputs, task: str, part: VecNormalize
) -> DeployedNetwork:
    """The network of one task, as a robot runs it: a network like any other.

    The task's label is constant, so that its column becomes part of the first layer's bias; columns of terms that the
    task does not observe are left out.
    """
    weights = learner.policy.state_dict()
    weight, bias = (weights[f"mlp_extractor.policy_net.0.{name}"] for name in ("weight", "bias"))
    own = {
        "weight": weight[:, torch.from_numpy(inputs.columns(task))],
        "bias": bias + weight[:, inputs.label(task)],
    }
    worlds = part.venv
    assert isinstance(worlds, BatchVecEnv)
    scale = worlds.robot.actuators.scale
    return deployed_network(learner, part, scale, first_layer=own)


def normalised(worlds: BatchVecEnv, gamma: float, statistics: torch.Tensor | None) -> VecNormalize:
    """Worlds behind a normaliser that learns, or by fixed statistics of `JointNetwork`."""
    part = VecNormalize(worlds, norm_reward=False, gamma=gamma, training=statistics is None)
    if statistics is not None:
        measured = part.obs_rms
        assert isinstance(measured, RunningMeanStd)
        measured.mean, measured.var = statistics.numpy()
    return part


def _statistics_of(part: VecNormalize) -> torch.Tensor:
    statistics = part.obs_rms
    assert isinstance(statistics, RunningMeanStd)
    return torch.from_numpy(np.stack((statistics.mean, statistics.var)).astype(np.float64))
