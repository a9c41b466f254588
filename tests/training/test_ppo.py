"""The learning rate that follows the divergence, and what the settings become."""

from __future__ import annotations

from dataclasses import replace

import pytest

from training.learners import KlAdaptiveRate, build_learner


@pytest.fixture
def settings(small_settings):
    return replace(
        small_settings.algorithm, learning_rate=1e-3, learning_rate_range=(1e-4, 2e-3), target_kl=0.01
    )


@pytest.mark.parametrize(
    ("kl", "factor"),
    [(0.05, 1 / 1.5), (0.0201, 1 / 1.5), (0.0199, 1.0), (0.01, 1.0), (0.0051, 1.0), (0.0049, 1.5)],
)
def test_the_rate_falls_when_updates_go_too_far_and_rises_when_they_do_too_little(settings, kl, factor):
    rate = KlAdaptiveRate(settings)
    rate.update(kl)
    assert rate(0.5) == pytest.approx(1e-3 * factor)


@pytest.mark.parametrize(("kl", "end"), [(1.0, 1e-4), (0.0, 2e-3)])
def test_the_rate_stays_within_its_range(settings, kl, end):
    rate = KlAdaptiveRate(settings)
    for _ in range(20):
        rate.update(kl)
    assert rate(0.5) == end


def test_the_optimiser_really_learns_at_the_adapted_rate(learner, small_settings):
    ppo, _ = learner
    group = ppo.policy.optimizer.param_groups[0]
    assert group["lr"] == pytest.approx(ppo.learning_rate.rate)
    assert group["lr"] != small_settings.algorithm.learning_rate  # it has moved since the start


def test_the_learner_has_the_settings_it_was_given(learner, small_settings):
    ppo, _ = learner
    s = small_settings.algorithm
    assert (ppo.n_steps, ppo.batch_size, ppo.n_epochs) == (s.steps, s.minibatch, s.epochs)
    assert (ppo.gamma, ppo.gae_lambda, ppo.max_grad_norm) == (s.gamma, s.gae_lambda, s.max_grad_norm)
    assert [layer.out_features for layer in ppo.policy.mlp_extractor.policy_net[::2]] == list(s.hidden)


def test_two_learners_of_one_seed_begin_with_the_same_weights(small_settings, learner):
    import torch

    _, env = learner
    twins = [
        build_learner(small_settings.algorithm, env, seed=seed).policy.action_net.weight for seed in (5, 5, 6)
    ]
    assert torch.equal(twins[0], twins[1])
    assert not torch.equal(twins[0], twins[2])
