"""A second network that takes over when dead valves leave no pose that the robot can hold.

One network that learns both cases loses the rarer one: it explores with one standard deviation for all states, and
states with a full set of valves want a small one. The fallback policy therefore learns alone, among uncontrollable
robots only, and the deployed network hands over to it as soon as its disturbance inputs report such a loss.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from fulmar_core.tasks import Task
from fulmar_core.worlds.holdability import uncontrollable_losses
from fulmar_core.worlds.scenario import load_scenario
from training.network import DeployedNetwork, load_network
from training.run_folder import NETWORK_FILE
from training.settings import TrainingSettings, load_training_settings


@dataclass(frozen=True)
class FallbackPolicy:
    """Network of a fallback policy, and the failures at which it takes over."""

    network: DeployedNetwork
    losses: np.ndarray  # 1 for each dead valve, one row for each set of dead valves, shape (k, valves)


def fallback_settings(settings: TrainingSettings, robot: Robot, task: Task) -> TrainingSettings | None:
    """Training settings of a run's fallback policy; None if it has none.

    Raises:
        ConfigError: No such settings, or the two networks could not act as one.
    """
    if settings.fallback_policy is None:
        return None
    name = settings.fallback_policy.settings
    own = load_training_settings(robot, task, name)
    actuation = load_scenario(own.scenario).actuation
    uncontrollable = actuation.stranding  # word: YAML key of scenarios
    if not uncontrollable or not uncontrollable_losses(robot, actuation.failures):
        raise ConfigError(
            f"'fallback_policy': '{own.scenario}', the scenario of '{name}', must have "
            "'stranding: true', "  # word: YAML key of scenarios
            f"and '{robot.name}' thrusters whose loss makes it uncontrollable."
        )
    same = ("disturbance_inputs", "action_space")
    if own.fallback_policy is not None or any(getattr(own, key) != getattr(settings, key) for key in same):
        raise ConfigError(
            f"'fallback_policy': '{name}' must have the 'disturbance_inputs' and 'action_space' of the policy that "
            "hands over to it, and no fallback policy of its own."
        )
    return own


def load_fallback(run: Path, robot: Robot, settings: TrainingSettings) -> FallbackPolicy:
    """Load the fallback policy that a finished run left.

    Raises:
        ConfigError: Its scenario is missing.
        FileNotFoundError: The run has left no network.
    """
    lost = uncontrollable_losses(robot, load_scenario(settings.scenario).actuation.failures)
    losses = np.zeros((len(lost), len(robot.actuators.names)), dtype=np.float32)
    for row, which in zip(losses, lost, strict=True):
        row[list(which)] = 1.0
    network = load_network(run / NETWORK_FILE)
    assert isinstance(network, DeployedNetwork)
    return FallbackPolicy(network, losses)
