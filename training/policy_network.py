"""What every deployed network has in common, whatever it learned with."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from torch import nn

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from fulmar_core.states.rotation import Array


class PolicyNetwork(nn.Module):
    """Observation and memory in, command, raw outputs and next memory out; what `export` writes to ONNX.

    Attributes:
        plan: Structure of the network; `inputs`, `memory`, `command_scale`, `on_off` and `disturbances` of any.
        remembers_command: Whether its memory ends with its last command, as shares of full command.
    """

    plan: Any
    remembers_command = False

    def infer(
        self, observation: Array, memory: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Command, raw outputs and next memory as NumPy.

        Args:
            observation: Shape (worlds, n).
            memory: Shape (worlds, `plan.memory`); zeros by default.
        """
        seen = torch.as_tensor(np.asarray(observation, dtype=np.float32))
        with torch.inference_mode():
            if not self.plan.memory:
                command, raw = self(seen)
                return command.numpy(), raw.numpy(), np.zeros((len(seen), 0), np.float32)
            before = torch.zeros(len(seen), self.plan.memory) if memory is None else torch.as_tensor(memory)
            command, raw, after = self(seen, before)
        return command.numpy(), raw.numpy(), after.numpy()

    def for_robot(self, robot: Robot) -> PolicyNetwork:
        """The same weights for another robot.

        Raises:
            ConfigError: They are for the robot that it learned on alone, or not for this one.
        """
        raise ConfigError(
            f"this network is not for '{robot.name}': it chooses actuators of the robot that it learned on. Train one "
            "with 'action_space: wrench' and 'body_inputs: true'."
        )

    def clear(self, observation: np.ndarray, memory: np.ndarray) -> np.ndarray:
        """Where no choice of the network is so near a tie that another processor may choose otherwise, (worlds,)."""
        return np.ones(len(observation), dtype=bool)
