"""Muon for the matrices of hidden layers and Adam for everything else, as the one optimiser that a policy has.

Muon moves a matrix along its gradient with all singular values made nearly alike, so that rare directions are learned
as fast as common ones (Jordan et al. 2024, kellerjordan.github.io/posts/muon). Its steps have the size that Adam's
would have (Liu et al., arXiv 2502.16982, §2.2), so that one learning rate suits both.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import torch
from torch import nn
from torch.optim import Adam, Muon, Optimizer

_MOMENTUM = 0.9


class MuonAndAdam(Optimizer):
    """One optimiser to whoever sets learning rates, steps, saves or loads; its closure must be None."""

    def __init__(
        self, parameters: Iterable[nn.Parameter], *, hidden: Sequence[nn.Parameter], lr: float, **adam: Any
    ) -> None:
        """Share the work out.

        Args:
            parameters: All of them.
            hidden: Those that are matrices of hidden layers, shapes (outputs, inputs).
            lr: Learning rate of both [-].
            adam: Everything else that Adam is told.

        Raises:
            ValueError: Something in `hidden` is no matrix.
        """
        every, by_muon = list(parameters), {id(matrix) for matrix in hidden}
        super().__init__(every, {"lr": lr})
        self._muon = Muon(hidden, lr=lr, weight_decay=0.0, momentum=_MOMENTUM, adjust_lr_fn="match_rms_adamw")
        self._adam = Adam([one for one in every if id(one) not in by_muon], lr=lr, **adam)
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
    """Weights of the linear layers among some layers, shapes (outputs, inputs)."""
    return [layer.weight for layer in layers if isinstance(layer, nn.Linear)]
