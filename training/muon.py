"""Muon for the matrices of hidden layers and Adam for everything else, as the one optimiser that a policy has.

Muon moves a matrix along its gradient with all singular values made nearly alike, so that rare directions are learned
as fast as common ones (Jordan et al. 2024, kellerjordan.github.io/posts/muon). Its steps have the size that Adam's
would have (Liu et al., arXiv 2502.16982, §2.2), so that one learning rate suits both.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import torch
from torch import nn
from torch.optim import Adam, Muon, Optimizer

_MOMENTUM = 0.9


class MuonAndAdam(Optimizer):
    """One optimiser to whoever sets learning rates, steps, saves or loads."""

    def __init__(
        self, hidden: Sequence[nn.Parameter], others: Sequence[nn.Parameter], *, lr: float, eps: float
    ) -> None:
        """Share the work out.

        Args:
            hidden: Matrices of hidden layers.
            others: All other parameters: biases, output layers, standard deviations.
            lr: Learning rate of both.
            eps: Adam's term against division by zero.
        """
        super().__init__([*hidden, *others], {"lr": lr})
        self._muon = Muon(hidden, lr=lr, weight_decay=0.0, momentum=_MOMENTUM, adjust_lr_fn="match_rms_adamw")
        self._adam = Adam(others, lr=lr, eps=eps, fused=True)
        self._share_groups()

    def _share_groups(self) -> None:
        """Who sets a learning rate here sets it there."""
        self.param_groups = [*self._muon.param_groups, *self._adam.param_groups]

    @torch.no_grad()
    def step(self, closure: Callable[[], float] | None = None) -> None:  # type: ignore[override]
        """Move every parameter by its gradient; there is nothing to evaluate again."""
        assert closure is None
        self._muon.step()
        self._adam.step()

    def state_dict(self) -> dict[str, Any]:
        """Both states."""
        return {"muon": self._muon.state_dict(), "adam": self._adam.state_dict()}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Go on from what `state_dict` returned."""
        self._muon.load_state_dict(state_dict["muon"])
        self._adam.load_state_dict(state_dict["adam"])
        self._share_groups()


def hidden_matrices(layers: Sequence[nn.Module]) -> list[nn.Parameter]:
    """Weights of the linear layers among some layers."""
    return [layer.weight for layer in layers if isinstance(layer, nn.Linear)]
