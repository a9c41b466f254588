"""The fast PPO computes what the PPO of Stable-Baselines3 computes."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
import torch
from gymnasium import spaces
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env
from torch import nn

from training.action_law import action_law
from training.fast_ppo import FastMlp, FastPPO

MULTI_BINARY, BOX = spaces.MultiBinary(3), spaces.Box(-1.0, 1.0, (2,))
ORDERS = spaces.MultiDiscrete([3, 3])


class Drift(gymnasium.Env):
    """A walk of five steps; the reward asks for actions of the signs that are observed."""

    def __init__(self, action_space):
        self.observation_space, self.action_space = spaces.Box(-np.inf, np.inf, (4,)), action_space

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.age, self.at = 0, self.np_random.normal(size=4).astype(np.float32)
        return self.at, {}

    def step(self, action):
        self.age += 1
        reward = float(np.mean(np.sign(self.at[: action.size]) * action))
        self.at = self.at + self.np_random.normal(size=4).astype(np.float32)
        return self.at, reward, bool(self.at[0] > 2.0), self.age >= 5, {}


def learner(kind, action_space, **kwargs):
    env = make_vec_env(lambda: Drift(action_space), n_envs=8, seed=1)
    return kind("MlpPolicy", env, n_steps=8, batch_size=16, n_epochs=2, seed=1, device="cpu", **kwargs)


@pytest.mark.parametrize(("precision", "near"), [(torch.float32, 1e-5), (torch.bfloat16, 3e-2)])
def test_outputs_and_gradients_are_those_of_torch(precision, near):
    torch.manual_seed(1)
    hidden = nn.Sequential(nn.Linear(4, 16), nn.Tanh(), nn.Linear(16, 8), nn.Tanh())
    head, inputs, pull = nn.Linear(8, 3), torch.randn(64, 4), torch.randn(64, 3)
    parameters = [*hidden.parameters(), *head.parameters()]
    fast = FastMlp(hidden, head, precision)
    outputs = fast(inputs)
    fast.backward(pull)
    gradients = [parameter.grad.clone() for parameter in parameters]
    exact = head(hidden(inputs))
    torch.testing.assert_close(outputs, exact, atol=near, rtol=near)
    for ours, theirs in zip(gradients, torch.autograd.grad((exact * pull).sum(), parameters), strict=True):
        assert (ours - theirs).norm() <= near * theirs.norm()


def test_hidden_layers_of_another_kind_are_refused():
    with pytest.raises(ValueError, match="followed by tanh"):
        FastMlp(nn.Sequential(nn.Linear(4, 4), nn.ReLU()), nn.Linear(4, 1), torch.float32)


@pytest.mark.parametrize("space", [MULTI_BINARY, ORDERS, BOX])
@pytest.mark.parametrize("of_entropy", [0.0, 0.3])
def test_gradients_of_the_action_laws_are_those_of_torch(space, of_entropy):
    policy = learner(FastPPO, space).policy
    law, outputs = action_law(policy), torch.randn(16, policy.action_net.out_features, requires_grad=True)
    actions, weights = law.sample(outputs).detach(), torch.randn(16)
    own = [policy.log_std] if space is BOX else []
    value = (weights * law.log_prob(outputs, actions)).sum() + of_entropy * law.entropy(outputs)
    expected = torch.autograd.grad(value, [outputs, *own])
    with torch.no_grad():
        gradients = [law.backward(outputs, actions, weights, of_entropy), *(each.grad for each in own)]
    for ours, theirs in zip(gradients, expected, strict=True):
        torch.testing.assert_close(ours, theirs, atol=1e-5, rtol=1e-5)


@pytest.mark.parametrize("space", [MULTI_BINARY, ORDERS, BOX])
def test_values_and_log_probabilities_are_those_of_the_policy_class(space):
    fast = learner(FastPPO, space)
    observations = torch.randn(32, 4)
    with torch.no_grad():
        actions, values, log_probs = fast.policy(observations)
        torch.testing.assert_close(fast._critic(observations), values, atol=1e-5, rtol=1e-5)
        outputs = fast._actor(observations)
        torch.testing.assert_close(
            fast._law.log_prob(outputs, actions.float()), log_probs, atol=1e-5, rtol=1e-5
        )
        entropy = fast.policy.evaluate_actions(observations, actions)[2].mean()
        torch.testing.assert_close(fast._law.entropy(outputs), entropy, atol=1e-5, rtol=1e-5)


@pytest.mark.parametrize("space", [MULTI_BINARY, ORDERS, BOX])
def test_drawn_actions_are_spread_as_the_policy_class_draws_them(space):
    fast = learner(FastPPO, space)
    observations = torch.randn(1, 4).expand(20_000, 4)
    with torch.no_grad():
        ours, theirs = fast._law.sample(fast._actor(observations)), fast.policy(observations)[0].float()
    torch.testing.assert_close(ours.mean(0), theirs.mean(0), atol=0.04, rtol=0.0)
    torch.testing.assert_close(ours.std(0), theirs.std(0), atol=0.04, rtol=0.0)


@pytest.mark.parametrize("space", [MULTI_BINARY, ORDERS, BOX])
@pytest.mark.parametrize("ent_coef", [0.0, 0.01])
def test_an_update_moves_the_weights_as_the_stock_update_does(space, ent_coef, monkeypatch):
    fast, stock = (learner(kind, space, ent_coef=ent_coef) for kind in (FastPPO, PPO))
    stock.policy.load_state_dict(fast.policy.state_dict())
    stock.policy.optimizer.param_groups[0]["eps"] = fast.policy.optimizer.param_groups[0]["eps"]
    fast._setup_learn(100)
    fast._logger = stock._logger = fast.logger
    _, callback = fast._setup_learn(100)
    fast.collect_rollouts(fast.env, callback, fast.rollout_buffer, 8)
    for name in ("observations", "actions", "log_probs", "advantages", "returns", "values"):
        getattr(stock.rollout_buffer, name)[:] = getattr(fast.rollout_buffer, name)
    stock.rollout_buffer.full = True
    # Stable-Baselines3 orders samples by world, the fast PPO by step; both draw an order, here the same one.
    order = np.random.default_rng(1).permutation(64)
    by_step = torch.as_tensor((order % 8) * 8 + order // 8)
    monkeypatch.setattr(np.random, "permutation", lambda count: order)
    monkeypatch.setattr(torch, "randperm", lambda count: by_step)
    stock.train()
    fast.train()
    for ours, theirs in zip(fast.policy.parameters(), stock.policy.parameters(), strict=True):
        torch.testing.assert_close(ours, theirs, atol=2e-5, rtol=1e-3)


@pytest.mark.parametrize("space", [MULTI_BINARY, ORDERS, BOX])
def test_a_rollout_gives_the_returns_that_the_stock_buffer_would(space):
    fast = learner(FastPPO, space, gae_lambda=1.0, gamma=0.9)
    _, callback = fast._setup_learn(100)
    fast.collect_rollouts(fast.env, callback, fast.rollout_buffer, 8)
    buffer = fast.rollout_buffer
    assert buffer.full
    assert fast.num_timesteps == 64
    ended = np.argwhere(buffer.episode_starts[1:] > 0)
    assert len(ended)
    for step, world in ended:  # with lambda = 1 the return of a last step is its reward and what came after
        assert buffer.returns[step, world] == pytest.approx(buffer.rewards[step, world], rel=1e-5)


def test_a_truncated_episode_is_worth_what_its_last_observation_promises():
    fast = learner(FastPPO, MULTI_BINARY, gamma=0.5)
    _, callback = fast._setup_learn(100)
    seen = []
    step_wait = fast.env.step_wait

    def spy():
        observations, rewards, dones, infos = step_wait()
        seen.append((rewards.copy(), infos))
        return observations, rewards, dones, infos

    fast.env.step_wait = spy
    fast.collect_rollouts(fast.env, callback, fast.rollout_buffer, 8)
    checked = 0
    for step, (rewards, infos) in enumerate(seen):
        for world, info in enumerate(infos):
            promised = 0.0
            if info.get("TimeLimit.truncated"):
                last = torch.as_tensor(info["terminal_observation"]).reshape(1, -1)
                promised = 0.5 * float(fast.policy.predict_values(last).detach())
                checked += 1
            expected = rewards[world] + promised
            assert fast.rollout_buffer.rewards[step, world] == pytest.approx(expected, abs=1e-4)
    assert checked > 0


def test_a_loaded_learner_is_the_one_that_was_saved(tmp_path):
    fast = learner(FastPPO, BOX)
    fast.learn(128)
    fast.save(tmp_path / "learner.zip")
    again = FastPPO.load(tmp_path / "learner.zip", env=fast.env, device="cpu")
    seen = np.zeros((1, 4), np.float32)
    np.testing.assert_array_equal(
        fast.predict(seen, deterministic=True)[0], again.predict(seen, deterministic=True)[0]
    )
    again.learn(128, reset_num_timesteps=False)
    assert again.num_timesteps == 256


@pytest.mark.parametrize(
    "space", [MULTI_BINARY, *(pytest.param(space, marks=pytest.mark.slow) for space in (ORDERS, BOX))]
)
def test_it_learns(space):
    fast = learner(FastPPO, space, learning_rate=3e-3, precision="bfloat16")
    fast.learn(4_000)
    seen = np.random.default_rng(1).normal(size=(500, 4)).astype(np.float32)
    actions = fast.predict(seen, deterministic=True)[0]
    wanted = seen[:, : actions.shape[1]] > 0.0
    middle = 1 if space is ORDERS else 0
    assert (wanted == (actions > middle)).mean() > 0.8


def test_other_actions_are_refused():
    with pytest.raises(ValueError, match="MultiBinary, MultiDiscrete or Box, not Discrete"):
        learner(FastPPO, spaces.Discrete(3))
