"""One policy for several tasks of a robot, with a label for each task among its inputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import torch
from torch import nn

from training.network import DeployedNetwork


class JointPolicy(nn.Module):
    """Hidden layers that tasks share, over their observation terms and a label for each task.

    Terms of one name share an input. The label of a task is 1 where the task is asked for and 0 elsewhere; terms that a
    task does not observe are 0. Terms are normalised as in the network that a task was learned with.

    Attributes:
        inputs: Names of all inputs; the label of a task has the name of the task.
        layers: From inputs to raw outputs, as `DeployedNetwork.layers`.
    """

    def __init__(self, terms: Mapping[str, Sequence[str]], hidden: Sequence[int], outputs: int) -> None:
        """Draw weights; `terms` are the observation terms of each task, in the order of its observations."""
        super().__init__()
        self.inputs = (*dict.fromkeys(name for names in terms.values() for name in names), *terms)
        self._columns = {
            task: torch.tensor([self.inputs.index(name) for name in names]) for task, names in terms.items()
        }
        layers: list[nn.Module] = []
        width = len(self.inputs)
        for size in hidden:
            layers += [nn.Linear(width, size), nn.Tanh()]
            width = size
        self.layers = nn.Sequential(*layers, nn.Linear(width, outputs))

    def features(self, task: str, observations: torch.Tensor) -> torch.Tensor:
        """Inputs for normalised observations of a task, shape (rows, inputs)."""
        rows = torch.zeros(len(observations), len(self.inputs))
        rows[:, self._columns[task]] = observations
        rows[:, self.inputs.index(task)] = 1.0
        return rows

    def forward(self, features: torch.Tensor) -> torch.Tensor:
        """Raw outputs, shape (rows, outputs)."""
        raw: torch.Tensor = self.layers(features)
        return raw

    @torch.no_grad()
    def network_of(self, task: str, learned: DeployedNetwork) -> DeployedNetwork:
        """The network of one task within it, as a robot runs it; `learned` is the one that the task was learned with.

        The label of the task is constant, so its column becomes part of the first layer's bias.
        """
        linear = [layer for layer in self.layers if isinstance(layer, nn.Linear)]
        plan = replace(
            learned.plan, hidden=tuple(layer.out_features for layer in linear[:-1]), activation="tanh"
        )
        with torch.random.fork_rng(devices=[]):
            network = DeployedNetwork(plan)
        own = {name: value for name, value in learned.state_dict().items() if not name.startswith("layers.")}
        network.load_state_dict(own, strict=False)
        first = linear[0].weight
        bias = linear[0].bias + first[:, self.inputs.index(task)]
        states = [{"weight": first[:, self._columns[task]], "bias": bias}]
        states += [layer.state_dict() for layer in linear[1:]]
        twins = [layer for layer in network.layers if isinstance(layer, nn.Linear)]
        for twin, state in zip(twins, states, strict=True):
            twin.load_state_dict(state)
        return network
