"""Distributions of actions, shaped by the outputs of a policy network, with their gradients."""

from __future__ import annotations

import math
from typing import Protocol

import torch
from gymnasium import spaces
from stable_baselines3.common.policies import ActorCriticPolicy
from torch.nn.functional import log_softmax, one_hot, softplus

from training.incremental_actions import KINDS


class ActionLaw(Protocol):
    """A distribution of actions, shaped by the network's outputs, shapes (batch, m) and (batch, n)."""

    def sample(self, outputs: torch.Tensor) -> torch.Tensor:
        """Draw actions, shape (batch, m)."""

    def log_prob(self, outputs: torch.Tensor, actions: torch.Tensor) -> torch.Tensor:
        """Logarithm of the probability (density) of actions, shape (batch,)."""

    def entropy(self, outputs: torch.Tensor) -> torch.Tensor:
        """Mean entropy over the batch, a scalar."""

    def backward(
        self, outputs: torch.Tensor, actions: torch.Tensor, weights: torch.Tensor, of_entropy: float
    ) -> torch.Tensor:
        """Gradient of `(weights * log_prob).sum() + of_entropy * entropy`.

        Args:
            outputs: The network's.
            actions: Those that were drawn.
            weights: Of each row, shape (batch,).
            of_entropy: Weight of the entropy.

        Returns:
            With respect to the outputs, shape (batch, n); with respect to parameters of the law itself it is left
            in their `grad`.
        """


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

    def backward(
        self, outputs: torch.Tensor, actions: torch.Tensor, weights: torch.Tensor, of_entropy: float
    ) -> torch.Tensor:
        """See `ActionLaw.backward`."""
        on = torch.sigmoid(outputs)
        gradient = (actions - on).mul_(weights.unsqueeze(1))
        if of_entropy:
            gradient -= of_entropy / len(outputs) * outputs * on * (1.0 - on)
        return gradient


class Categorical:
    """Each actuator takes one of `KINDS` actions, with probabilities from as many outputs, actuator by actuator."""

    def sample(self, outputs: torch.Tensor) -> torch.Tensor:
        """Draw numbers of actions, by the largest logit with Gumbel noise."""
        noise = -torch.empty_like(outputs).exponential_().log_()
        return _by_actuator(outputs + noise).argmax(2).float()

    def log_prob(self, outputs: torch.Tensor, actions: torch.Tensor) -> torch.Tensor:
        """Sum over the actuators."""
        logs = log_softmax(_by_actuator(outputs), 2)
        return logs.gather(2, actions.long().unsqueeze(2)).sum((1, 2))

    def entropy(self, outputs: torch.Tensor) -> torch.Tensor:
        """Sum over the actuators, mean over the batch."""
        logs = log_softmax(_by_actuator(outputs), 2)
        return -(logs.exp() * logs).sum((1, 2)).mean()

    def backward(
        self, outputs: torch.Tensor, actions: torch.Tensor, weights: torch.Tensor, of_entropy: float
    ) -> torch.Tensor:
        """See `ActionLaw.backward`."""
        logs = log_softmax(_by_actuator(outputs), 2)
        chances = logs.exp()
        gradient = (one_hot(actions.long(), KINDS) - chances).mul_(weights.view(-1, 1, 1))
        if of_entropy:
            mean = (chances * logs).sum(2, keepdim=True)
            gradient -= of_entropy / len(outputs) * chances * (logs - mean)
        return gradient.flatten(1)


def _by_actuator(outputs: torch.Tensor) -> torch.Tensor:
    return outputs.unflatten(1, (-1, KINDS))


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
        squares = ((actions - outputs) * (-self._log_std).exp()).square_()
        return -0.5 * squares.sum(1) - (self._log_std + 0.5 * math.log(2.0 * math.pi)).sum()

    def entropy(self, outputs: torch.Tensor) -> torch.Tensor:
        """The same for every row."""
        return (self._log_std + 0.5 * math.log(2.0 * math.pi * math.e)).sum()

    def backward(
        self, outputs: torch.Tensor, actions: torch.Tensor, weights: torch.Tensor, of_entropy: float
    ) -> torch.Tensor:
        """See `ActionLaw.backward`."""
        narrow = (-self._log_std).exp()
        away = (actions - outputs) * narrow
        of_std = ((away.square() - 1.0) * weights.unsqueeze(1)).sum(0)
        self._log_std.grad = of_std + of_entropy
        return away * narrow * weights.unsqueeze(1)


def action_law(policy: ActorCriticPolicy) -> ActionLaw:
    """The law that fits a policy's action space.

    Raises:
        ValueError: Neither MultiBinary, MultiDiscrete nor Box.
    """
    space = policy.action_space
    if isinstance(space, spaces.MultiBinary):
        return OnOff()
    if isinstance(space, spaces.MultiDiscrete):
        return Categorical()
    if isinstance(space, spaces.Box):
        return Gaussian(policy.log_std)
    raise ValueError(f"actions must be MultiBinary, MultiDiscrete or Box, not {type(space).__name__}")
