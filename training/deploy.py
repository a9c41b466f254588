"""Conversion of a learner to the network that a robot runs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from sb3_contrib import RecurrentPPO
from stable_baselines3 import PPO, SAC, TD3
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecNormalize
from torch import nn

from training.bodies import KnownBodies
from training.fallback_policy import FallbackPolicy
from training.network import Decision, DeployedNetwork, NetworkPlan
from training.vec_env import BatchVecEnv


@dataclass(frozen=True)
class _Trained:
    """Layers and decision behind the deterministic actions of a learner."""

    layers: list[nn.Module]  # hidden layers and output layer, with activations between
    decision: Decision
    lstm: nn.LSTM | None = None

    @property
    def linear(self) -> list[nn.Linear]:
        return [layer for layer in self.layers if isinstance(layer, nn.Linear)]


def deployed_network(
    learner: BaseAlgorithm,
    normaliser: VecNormalize,
    command_scale: Iterable[float],
    fallback: FallbackPolicy | None = None,
) -> DeployedNetwork:
    """Copy a learner's present weights and statistics.

    Args:
        learner: PPO, recurrent PPO, SAC or TD3 with an MLP policy.
        normaliser: Holds the running mean and variance of the observations.
        command_scale: Full command of each actuator, in its own unit.
        fallback: Policy that takes over when the robot is uncontrollable.

    Returns:
        A network that shares nothing with the learner.
    """
    statistics = normaliser.obs_rms
    assert not isinstance(statistics, dict)
    worlds = normaliser.unwrapped
    choice = worlds.choice if isinstance(worlds, BatchVecEnv) else None
    mirror = worlds.mirror if isinstance(worlds, BatchVecEnv) else None
    bodies = worlds.bodies if isinstance(worlds, BatchVecEnv) else None
    wrench: Decision | None = "choose" if choice is not None else "allocate" if bodies is not None else None
    trained = _trained(learner, wrench)
    plan = NetworkPlan(
        inputs=len(statistics.mean),
        hidden=tuple(layer.out_features for layer in trained.linear[:-1]),
        outputs=int(trained.linear[-1].out_features),  # a NumPy number for a MultiDiscrete space
        activation="relu" if any(isinstance(layer, nn.ReLU) for layer in trained.layers) else "tanh",
        decision=trained.decision,
        command_scale=tuple(float(value) for value in command_scale),
        limit=float(normaliser.clip_obs),
        memory=2 * trained.lstm.hidden_size if trained.lstm else 0,
        combinations=len(choice.commands) if choice else 0,
        disturbances=isinstance(worlds, BatchVecEnv) and worlds.takes_disturbances,
        knows_dead=choice is not None and worlds.takes_disturbances,
        side=mirror.side if mirror else None,
        fallback=fallback.network.plan if fallback else None,
        losses=len(fallback.losses) if fallback else 0,
        body=bodies is not None and worlds.takes_body,
    )
    with torch.random.fork_rng(devices=[]):  # must not change what the learner draws next
        network = DeployedNetwork(plan)
    with torch.no_grad():
        network.mean.copy_(torch.as_tensor(statistics.mean, dtype=torch.float32))
        deviation = np.sqrt(statistics.var + normaliser.epsilon)
        network.scale.copy_(torch.as_tensor(deviation, dtype=torch.float32))
        twins = [layer for layer in network.layers if isinstance(layer, nn.Linear)]
        for twin, layer in zip(twins, trained.linear, strict=True):
            twin.load_state_dict(layer.state_dict())
        if choice is not None:
            network.take_choice(choice)
        if bodies is not None:
            network.take_bodies(KnownBodies.of_robot(worlds.robot))
        if mirror is not None:
            network.take_mirror(mirror)
        if fallback is not None:
            network.take_fallback(fallback.network, fallback.losses)
        if trained.lstm is not None:
            _copy_memory(trained.lstm, network)
    return network


def _trained(learner: BaseAlgorithm, wrench: Decision | None) -> _Trained:
    policy: Any = learner.policy
    if isinstance(learner, SAC):
        return _Trained([*policy.actor.latent_pi, policy.actor.mu], "squash")
    if isinstance(learner, TD3):
        return _Trained(list(policy.actor.mu)[:-1], "squash")  # its last layer is the tanh that `squash` is
    assert isinstance(learner, PPO | RecurrentPPO)
    layers = [*policy.mlp_extractor.policy_net, policy.action_net]
    on_off = isinstance(learner.action_space, spaces.MultiBinary)
    incremental = isinstance(learner.action_space, spaces.MultiDiscrete)
    decision = wrench or ("threshold" if on_off else "increment" if incremental else "clamp")
    return _Trained(layers, decision, getattr(policy, "lstm_actor", None))


def _copy_memory(lstm: nn.LSTM, network: DeployedNetwork) -> None:
    assert network.from_input is not None
    assert network.from_memory is not None
    network.from_input.weight.copy_(lstm.weight_ih_l0)
    network.from_input.bias.copy_(lstm.bias_ih_l0)
    network.from_memory.weight.copy_(lstm.weight_hh_l0)
    network.from_memory.bias.copy_(lstm.bias_hh_l0)
