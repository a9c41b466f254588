"""Muon for hidden layers and Adam for the rest act as one optimiser."""

from __future__ import annotations

import copy
from dataclasses import replace

import pytest
import torch
from torch import nn

from training.learners import build_learner
from training.muon import MuonAndAdam, hidden_matrices


@pytest.fixture
def network():
    torch.manual_seed(1)
    return nn.Sequential(nn.Linear(6, 16), nn.Tanh(), nn.Linear(16, 12), nn.Tanh(), nn.Linear(12, 2))


def optimiser_of(network, lr=1e-2):
    return MuonAndAdam(network.parameters(), hidden=hidden_matrices(network[:-1]), lr=lr, eps=1e-5)


def pull(network, seed=0):
    """Leave gradients of some loss."""
    torch.manual_seed(seed)
    network.zero_grad()
    (network(torch.randn(64, 6)) - torch.randn(64, 2)).square().mean().backward()


def moved(network, steps, optimiser):
    before = [parameter.detach().clone() for parameter in network.parameters()]
    for seed in range(steps):
        pull(network, seed)
        optimiser.step()
    return [(now - then).detach() for now, then in zip(network.parameters(), before, strict=True)]


def test_hidden_matrices_move_alike_in_all_directions_and_the_rest_as_by_adam(network):
    twin = copy.deepcopy(network)
    ours = moved(network, 1, optimiser_of(network))
    gradients = [parameter.grad for parameter in network.parameters()]
    adams = moved(twin, 1, torch.optim.Adam(twin.parameters(), lr=1e-2, eps=1e-5))
    for i, (own, other) in enumerate(zip(ours, adams, strict=True)):
        if i in (0, 2):  # weights of the hidden layers
            ours_alike, its_own = (_median_share(matrix) for matrix in (own, gradients[i]))
            assert ours_alike > 0.6 > its_own
            assert own.square().mean().sqrt() == pytest.approx(0.2 * 1e-2, rel=0.5)
        else:
            torch.testing.assert_close(own, other)


def _median_share(matrix):
    """Of the middle one of the singular values in the largest one."""
    singular = torch.linalg.svdvals(matrix)
    return singular.median() / singular.max()


def test_a_learning_rate_that_is_set_reaches_every_parameter(network):
    optimiser = optimiser_of(network)
    for group in optimiser.param_groups:
        group["lr"] = 0.0
    assert all(torch.count_nonzero(move) == 0 for move in moved(network, 2, optimiser))


def test_a_restored_optimiser_goes_on_to_the_last_bit_and_still_listens(network):
    optimiser = optimiser_of(network)
    moved(network, 3, optimiser)
    twin = copy.deepcopy(network)
    restored = optimiser_of(twin)
    restored.load_state_dict(copy.deepcopy(optimiser.state_dict()))
    for ours, theirs in zip(moved(twin, 3, restored), moved(network, 3, optimiser), strict=True):
        assert torch.equal(ours, theirs)
    for group in restored.param_groups:
        group["lr"] = 0.0
    assert all(torch.count_nonzero(move) == 0 for move in moved(twin, 1, restored))


def test_settings_choose_the_optimiser_and_every_parameter_has_exactly_one(small_settings, learner):
    _, env = learner
    algorithm = replace(small_settings.algorithm, optimizer="muon")
    policy = build_learner(algorithm, env, seed=1).policy
    assert isinstance(policy.optimizer, MuonAndAdam)
    found = [parameter for group in policy.optimizer.param_groups for parameter in group["params"]]
    assert sorted(map(id, found)) == sorted(map(id, policy.parameters()))
    by_muon = policy.optimizer.param_groups[0]["params"]
    assert {id(weight) for weight in by_muon} == {
        id(layer.weight)
        for net in (policy.mlp_extractor.policy_net, policy.mlp_extractor.value_net)
        for layer in net
        if isinstance(layer, nn.Linear)
    }


def test_the_stock_ppo_refuses_it(small_settings):
    stock = replace(small_settings.algorithm, fast=False, optimizer="muon")
    with pytest.raises(ValueError, match="'optimizer: muon' is for the fast PPO"):
        replace(small_settings, algorithm=stock)
