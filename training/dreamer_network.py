"""The policy of DreamerV3 as a robot runs it: one step of its world model, and its actor.

Hafner et al., arXiv 2301.04104, as sheeprl 0.8.4 computes it (`PlayerDV3.get_actions`), but for two things: the
discrete state is the likeliest one and not a sample, and the command is the mean of the actor's distribution.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import torch
from torch import nn

from training.policy_network import PolicyNetwork

EPSILON = 1e-3  # of sheeprl's layer norms
CLEAR = 1e-3  # logits of two classes that are nearer than this may change places on another processor
Weights = Mapping[str, torch.Tensor]


@dataclass(frozen=True)
class DreamerPlan:
    """Structure of the network: everything but its numbers."""

    inputs: int  # observation terms
    recurrent: int  # numbers of the deterministic state
    groups: int  # variables of the discrete state
    classes: int  # of each
    dense: int  # units of each hidden layer
    layers: int  # hidden layers of encoder and actor
    command_scale: tuple[float, ...]  # full command of each actuator, in its own unit
    on_off: bool = False
    disturbances: bool = False

    @property
    def observed(self) -> int:
        """Number of observation terms that it is given."""
        return self.inputs

    @property
    def discrete(self) -> int:
        """Numbers of the discrete state, ones and zeros."""
        return self.groups * self.classes

    @property
    def memory(self) -> int:
        """Numbers of deterministic state, discrete state and last command, in this order."""
        return self.recurrent + self.discrete + len(self.command_scale)


class DreamerNetwork(PolicyNetwork):
    """Memory begins with zeros on a robot and with a learned state in DreamerV3: it holds the difference from that."""

    command_scale: torch.Tensor
    first: torch.Tensor
    numbers: torch.Tensor
    remembers_command = True

    def __init__(self, plan: DreamerPlan) -> None:
        super().__init__()
        self.plan = plan
        count, state = len(plan.command_scale), plan.recurrent + plan.discrete
        self.register_buffer("command_scale", torch.tensor(plan.command_scale, dtype=torch.float32))
        self.register_buffer("first", torch.zeros(plan.memory))
        self.register_buffer("numbers", torch.arange(plan.classes), persistent=False)
        self.encoder = nn.Sequential(*_hidden(plan.inputs, plan.dense, plan.layers))
        self.moved = nn.Sequential(*_hidden(plan.discrete + count, plan.dense, 1))
        self.gates = nn.Linear(plan.recurrent + plan.dense, 3 * plan.recurrent, bias=False)
        self.gates_norm = nn.LayerNorm(3 * plan.recurrent, eps=EPSILON)
        self.posterior = nn.Sequential(
            *_hidden(plan.recurrent + plan.dense, plan.dense, 1), nn.Linear(plan.dense, plan.discrete)
        )
        self.actor = nn.Sequential(*_hidden(state, plan.dense, plan.layers), nn.Linear(plan.dense, count))
        self.eval()

    def forward(self, observation: torch.Tensor, memory: torch.Tensor) -> tuple[torch.Tensor, ...]:
        """Choose commands.

        Args:
            observation: Raw terms, shape (worlds, n).
            memory: What it returned the time before, zeros at first, shape (worlds, `plan.memory`).

        Returns:
            Commands in the actuators' units and the raw outputs behind them, both of shape (worlds, m), and the next
            memory.
        """
        state, logits = self._state(observation, memory)
        chosen = (logits.argmax(2, keepdim=True) == self.numbers).to(state.dtype).flatten(1)
        raw = self.actor(torch.cat((chosen, state), dim=1))
        share = torch.tanh(raw)
        after = torch.cat((state, chosen, share), dim=1) - self.first
        return share * self.command_scale, raw, after

    def _state(self, observation: torch.Tensor, memory: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Next deterministic state (worlds, recurrent) and logits of the discrete one (worlds, groups, classes)."""
        plan = self.plan
        state, moved = (memory + self.first).split([plan.recurrent, plan.memory - plan.recurrent], dim=1)
        gates = self.gates_norm(self.gates(torch.cat((state, self.moved(moved)), dim=1)))
        reset, candidate, update = gates.chunk(3, dim=1)
        share = torch.sigmoid(update - 1.0)
        state = share * torch.tanh(torch.sigmoid(reset) * candidate) + (1.0 - share) * state
        seen = self.encoder(torch.sign(observation) * torch.log(1.0 + torch.abs(observation)))
        logits = self.posterior(torch.cat((state, seen), dim=1))
        return state, logits.unflatten(1, (plan.groups, plan.classes))

    def clear(self, observation: np.ndarray, memory: np.ndarray) -> np.ndarray:
        """See `PolicyNetwork.clear`: both best classes of each variable are `CLEAR` apart."""
        with torch.inference_mode():
            _, logits = self._state(torch.as_tensor(observation), torch.as_tensor(memory))
            best = logits.topk(2, dim=2).values
            found: np.ndarray = ((best[..., 0] - best[..., 1]) > CLEAR).all(1).numpy()
        return found

    def take(self, world_model: Weights, actor: Weights) -> None:
        """Copy the weights of sheeprl's `WorldModel` and `Actor`, and where an episode begins in their latent space.

        Raises:
            LookupError: They lack a tensor.
            RuntimeError: A tensor has another shape than the plan says.
        """
        rssm, count = "rssm.", len(self.plan.command_scale)
        with torch.no_grad():
            self.encoder.load_state_dict(_part(world_model, "encoder.mlp_encoder.model._model."))
            self.moved.load_state_dict(_part(world_model, f"{rssm}recurrent_model.mlp._model."))
            self.gates.load_state_dict(_part(world_model, f"{rssm}recurrent_model.rnn.linear."))
            self.gates_norm.load_state_dict(_part(world_model, f"{rssm}recurrent_model.rnn.layer_norm."))
            self.posterior.load_state_dict(_part(world_model, f"{rssm}representation_model._model."))
            layers, last = _part(actor, "model._model."), len(self.actor) - 1
            head = _part(actor, "mlp_heads.0.")  # means, then what standard deviations are made from
            self.actor.load_state_dict(
                layers | {f"{last}.{name}": part[:count] for name, part in head.items()}
            )
            self.first.copy_(self._first(world_model))

    def _first(self, world_model: Weights) -> torch.Tensor:
        """Memory before an episode: learned state, the likeliest discrete state then, no command."""
        plan = self.plan
        prior = nn.Sequential(*_hidden(plan.recurrent, plan.dense, 1), nn.Linear(plan.dense, plan.discrete))
        prior.load_state_dict(_part(world_model, "rssm.transition_model._model."))
        state = torch.tanh(world_model["rssm.initial_recurrent_state"])[None]
        logits = prior(state).unflatten(1, (plan.groups, plan.classes))
        chosen = (logits.argmax(2, keepdim=True) == self.numbers).to(state.dtype).flatten(1)
        return torch.cat((state, chosen, torch.zeros(1, len(plan.command_scale))), dim=1)[0]


def _hidden(inputs: int, units: int, layers: int) -> list[nn.Module]:
    """Hidden layers as sheeprl builds them."""
    found: list[nn.Module] = []
    for _ in range(layers):
        found += [nn.Linear(inputs, units, bias=False), nn.LayerNorm(units, eps=EPSILON), nn.SiLU()]
        inputs = units
    return found


def _part(weights: Weights, prefix: str) -> dict[str, torch.Tensor]:
    """Tensors whose names begin so, under the rest of their names."""
    return {name.removeprefix(prefix): value for name, value in weights.items() if name.startswith(prefix)}
