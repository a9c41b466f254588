"""What a training run is made with, as read from `configs/training/<robot>_<task>.yaml`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from fulmar_core.config import load_config
from fulmar_core.errors import ConfigError
from fulmar_core.paths import config_names, config_path


@dataclass(frozen=True)
class PpoSettings:
    """Hyper-parameters of PPO (Schulman et al., arXiv 1707.06347), in its own terms."""

    worlds: int  # simulated in one batch
    steps: int  # control steps of each world between updates
    minibatch: int
    epochs: int
    learning_rate: float  # to begin with
    learning_rate_range: tuple[float, float]
    target_kl: float  # the learning rate moves to keep the KL divergence of an update near this
    gamma: float
    gae_lambda: float
    clip_range: float
    max_grad_norm: float
    reward_scale: float
    hidden: tuple[int, ...]  # sizes of the hidden layers, of policy and value alike

    def __post_init__(self) -> None:
        """Refuse sizes that do not divide."""
        if (self.worlds * self.steps) % self.minibatch:
            raise ValueError(
                f"worlds · steps = {self.worlds * self.steps} must be a multiple of 'minibatch'."
            )


@dataclass(frozen=True)
class TrainingSettings:
    """Algorithm, scenario and when to stop."""

    algorithm: Literal["ppo"]
    scenario: str  # name of the scenario that episodes are drawn from
    time_limit_s: float  # wall-clock of the learning itself [s]
    evaluate_every_s: float  # wall-clock between checks on held-out episodes [s]
    ppo: PpoSettings


def load_training_settings(robot: str, task: str) -> TrainingSettings:
    """Read `configs/training/<robot>_<task>.yaml`.

    Args:
        robot: Name of the robot.
        task: Name of the task.

    Returns:
        The settings.

    Raises:
        ConfigError: No such file, or a mistake in it.
    """
    name = f"{robot}_{task}"
    if name not in config_names("training"):
        raise ConfigError(
            f"no training settings for '{robot}' and '{task}'. Write configs/training/{name}.yaml."
        )
    return load_config(TrainingSettings, config_path("training", name))
