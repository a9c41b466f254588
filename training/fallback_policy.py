"""A second network for what the first is better not taught: coming to rest where dead valves leave no pose to hold.

One network that learns both loses the rarer: how much it tries out is one standard deviation for all situations, and
those with a full set of valves want it small. So the specialist learns alone, among stranded robots only, and the
network that is deployed hands over to it as soon as it is told of such a loss.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.errors import ConfigError
from fulmar_core.holdability import uncontrollable_losses
from fulmar_core.robot import Robot
from fulmar_core.tasks import Task
from training.network import DeployedNetwork, load_network
from training.run_folder import NETWORK_FILE
from training.settings import TrainingSettings, load_training_settings


@dataclass(frozen=True)
class Specialist:
    """Who takes over, and when."""

    network: DeployedNetwork
    losses: np.ndarray  # 1 for each valve that is dead, of all sets that it takes over at, shape (k, valves)


def specialist_settings(settings: TrainingSettings, robot: Robot, task: Task) -> TrainingSettings | None:
    """How a run's specialist learns; None if it has none.

    Raises:
        ConfigError: No such settings, or the two could not act as one.
    """
    if settings.specialist is None:
        return None
    name = settings.specialist.training
    own = load_training_settings(robot, task, name)
    stranded = load_scenario(own.scenario).actuation
    if not stranded.stranding or not uncontrollable_losses(robot, stranded.failures):
        raise ConfigError(
            f"'specialist': '{own.scenario}', the scenario of '{name}', must have 'stranding: true', and "
            f"'{robot.name}' thrusters that strand it when they are lost."
        )
    if own.specialist is not None or (own.told, own.wrench) != (settings.told, settings.wrench):
        raise ConfigError(
            f"'specialist': '{name}' must have the 'told' and 'wrench' of who hands over to it, and no specialist."
        )
    return own


def load_specialist(run: Path, robot: Robot, settings: TrainingSettings) -> Specialist:
    """The specialist that a finished run left.

    Args:
        run: Its own run folder.
        robot: The robot.
        settings: How it learned.

    Returns:
        Its network, and every set of dead valves that it takes over at.

    Raises:
        ConfigError: Its scenario is not there.
        FileNotFoundError: The run has left no network.
    """
    valves = len(robot.actuators.names)
    lost = uncontrollable_losses(robot, load_scenario(settings.scenario).actuation.failures)
    losses = np.zeros((len(lost), valves), dtype=np.float32)
    for row, which in zip(losses, lost, strict=True):
        row[list(which)] = 1.0
    return Specialist(load_network(run / NETWORK_FILE), losses)
