"""How actions are drawn from what a policy network puts out, in as few operations as possible."""

from __future__ import annotations

import math
from typing import Protocol

import torch
from gymnasium import spaces
from stable_baselines3.common.policies import ActorCriticPolicy
from torch.nn.functional import softplus


class ActionLaw(Protocol):
    """A distribution of actions, shaped by the network's outputs; arguments have shape (batch, m)."""

    def sample(self, outputs: torch.Tensor) -> torch.Tensor:
        """Draw actions, shape (batch, m)."""

    def log_prob(self, outputs: torch.Tensor, actions: torch.Tensor) -> torch.Tensor:
        """Logarithm of the probability (density) of actions, shape (batch,)."""

    def entropy(self, outputs: torch.Tensor) -> torch.Tensor:
        """Mean entropy over the batch, a scalar."""


class OnOff:
    """Each actuator is on with the probability whose logit the network gives."""

    def sample(self, outputs: torch.Tensor) -> torch.Tensor:
        """Draw zeros and ones."""
        return (torch.rand_like(outputs) < torch.sigmoid(outputs)).float()

    def log_prob(self, outputs: torch.Tensor, actions: torch.Tensor) -> torch.Tensor:
        """Sum over the actuators."""
        return (actions * outputs - softplus(outputs)).sum(1)

    def entropy(self, outputs: torch.Tensor) -> torch.Tensor:
        """Sum over the actuators, mean over the batch."""
        return (softplus(outputs) - outputs * torch.sigmoid(outputs)).sum(1).mean()


class Gaussian:
    """Each actuator is normally distributed around the output, as widely in every situation."""

    def __init__(self, log_std: torch.Tensor) -> None:
        """Take the learnt logarithm of the standard deviations, shape (m,)."""
        self._log_std = log_std

    def sample(self, outputs: torch.Tensor) -> torch.Tensor:
        """Draw around the outputs, without bound."""
        return outputs + torch.randn_like(outputs) * self._log_std.exp()

    def log_prob(self, outputs: torch.Tensor, actions: torch.Tensor) -> torch.Tensor:
        """Sum over the actuators."""
        away = (actions - outputs) * (-self._log_std).exp()
        return -0.5 * away.square().sum(1) - (self._log_std + 0.5 * math.log(2.0 * math.pi)).sum()

    def entropy(self, outputs: torch.Tensor) -> torch.Tensor:
        """The same for every row."""
        return (self._log_std + 0.5 * math.log(2.0 * math.pi * math.e)).sum()


def action_law(policy: ActorCriticPolicy) -> ActionLaw:
    """The law that fits a policy's action space.

    Raises:
        ValueError: Neither on/off nor a box.
    """
    space = policy.action_space
    if isinstance(space, spaces.MultiBinary):
        return OnOff()
    if isinstance(space, spaces.Box):
        return Gaussian(policy.log_std)
    raise ValueError(f"actions must be MultiBinary or Box, not {type(space).__name__}")
