"""A network that sees: convolutions over an image say where the goal is, a fixed law steers there.

Image (depth) → four convolutions of stride 2 → the berth's pose seen from the body: six numbers with known units, which
are learned; PD law and allocation to the valves follow from the robot's file and are part of the graph.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

# Before any renderer: imported after an EGL renderer was made, it ends the process by a segmentation fault. An
# optimiser of torch imports it.
import torch._dynamo
from torch import nn

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.classical import gains_of
from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.space_pd import SpacePdGains
from fulmar_core.controllers.wrench_shares import effect_of
from fulmar_core.loop.image_input import DEPTH, ImageInput
from fulmar_core.robots.actuators.pushing import Pushing
from fulmar_core.robots.robot import Robot
from fulmar_core.tasks import Task
from fulmar_core.tasks.observation import Observer
from fulmar_core.tasks.space_terms import MOTION_TERMS
from training.policy_network import PolicyNetwork

POSE = 6  # way to the goal in the body's frame [m], rotation vector to its attitude [rad]
LEAST_SHARE = 0.05  # of every nozzle in what all may open together without pushing or turning [-]


@dataclass(frozen=True)
class PoseLaw:
    """Linear law on a seen pose, with limits."""

    position: float  # K_p [N/m]
    velocity: float  # K_d [N·s/m]
    attitude: float  # [N·m/rad]
    rate: float  # [N·m·s/rad]
    way: float  # longer ones count as this, which sets the cruising speed [m]
    turn: float  # same of angles [rad]
    force: float  # largest [N]
    torque: float  # largest [N·m]

    @classmethod
    def of(cls, robot: Robot, *, speed: float, turn_rate: float) -> PoseLaw:
        """The PD law's gains of a robot, at a cruising speed [m/s] and turn rate [rad/s]."""
        gains = gains_of(robot, "pd")
        assert isinstance(gains, SpacePdGains)
        return cls(
            gains.position, gains.velocity, gains.attitude, gains.rate,
            way=speed * gains.velocity / gains.position, turn=turn_rate * gains.rate / gains.attitude,
            force=gains.braking_force, torque=gains.braking_torque,
        )  # fmt: skip


@dataclass(frozen=True)
class ImagePlan:
    """Structure of such a network: everything but its numbers."""

    image: ImageInput
    channels: tuple[int, ...]  # of the convolutions
    features: int  # of the layer behind them
    law: PoseLaw
    command_scale: tuple[float, ...]  # full command of each nozzle, in its own unit
    inputs: int = len(MOTION_TERMS)
    memory: int = 0
    disturbances: bool = False
    on_off: bool = False

    @property
    def observed(self) -> int:
        """Number of observation terms that it is given."""
        return self.inputs

    @classmethod
    def from_plain(cls, plain: dict[str, Any]) -> ImagePlan:
        """From what `asdict` makes of one."""
        more = {"image": ImageInput.from_plain(plain["image"]), "law": PoseLaw(**plain["law"])}
        return cls(**plain | more | {"channels": tuple(plain["channels"])})


class ImageNetwork(PolicyNetwork):
    """Own motion and an image in, commands and shares of full thrust out; what `export` writes to ONNX."""

    plan: ImagePlan
    spread: torch.Tensor
    together: torch.Tensor
    command_scale: torch.Tensor

    def __init__(self, plan: ImagePlan) -> None:
        super().__init__()
        self.plan = plan
        count = len(plan.command_scale)
        self.register_buffer("spread", torch.zeros(POSE, count))
        self.register_buffer("together", torch.ones(count))
        self.register_buffer("command_scale", torch.tensor(plan.command_scale, dtype=torch.float32))
        channels, rows, columns = plan.image.shape
        layers: list[nn.Module] = []
        for before, after in itertools.pairwise((channels, *plan.channels)):
            layers += [nn.Conv2d(before, after, 3, stride=2, padding=1), nn.ELU()]
            rows, columns = (rows + 1) // 2, (columns + 1) // 2
        self.eyes = nn.Sequential(*layers, nn.Flatten())
        self.pose = nn.Sequential(
            nn.Linear(plan.channels[-1] * rows * columns, plan.features),
            nn.ELU(),
            nn.Linear(plan.features, POSE),
        )
        self.eval()

    def take_allocation(self, robot: Robot) -> None:
        """Copy how nozzles share a wrench.

        Raises:
            ConfigError: They do not push by degrees, or not every one is part of what all may open together.
        """
        actuators = robot.actuated_by(Pushing)
        full = effect_of(robot).T
        shares = np.linalg.pinv(full)
        together = np.ones(len(full)) @ (np.eye(len(full)) - full @ shares)
        one_by_one = actuators.one_way and not (actuators.binary or actuators.shared_pressure)
        if not one_by_one or np.linalg.matrix_rank(full) < POSE or together.min() < LEAST_SHARE:
            raise ConfigError(
                f"'{robot.name}': a policy that sees steers nozzles that open by degrees, push and turn in every "
                "direction, and cancel when all are open. Train another kind of policy for it."
            )
        self.spread.copy_(torch.as_tensor(shares))
        self.together.copy_(torch.as_tensor(together))

    def scaled(self, image: torch.Tensor) -> torch.Tensor:
        """What the convolutions see of an image: see `image_input.SCALING`."""
        return (
            0.5 / torch.clamp(image, min=self.plan.image.near)
            if self.plan.image.reading == DEPTH
            else image / 255.0
        )

    def seen_pose(self, scaled: torch.Tensor) -> torch.Tensor:
        """The goal's pose seen from the body, shape (worlds, 6) [m, rad]."""
        found: torch.Tensor = self.pose(self.eyes(scaled))
        return found

    def forward(self, observation: torch.Tensor, image: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Choose commands.

        Args:
            observation: Velocity [m/s] and turn rate [rad/s] in the body's frame, shape (worlds, 6).
            image: Shape (worlds, *`ImageInput.shape`): metres, or 0 to 255.

        Returns:
            Commands in the actuators' units, and the shares before they are cut, both of shape (worlds, m).
        """
        shares = self.shares(observation, self.seen_pose(self.scaled(image)))
        return torch.clamp(shares, 0.0, 1.0) * self.command_scale, shares

    def shares(self, observation: torch.Tensor, pose: torch.Tensor) -> torch.Tensor:
        """Shares of full thrust for a pose of the goal, shape (worlds, m)."""
        law = self.plan.law
        force = law.position * _cut(pose[:, :3], law.way) - law.velocity * observation[:, :3]
        torque = law.attitude * _cut(pose[:, 3:], law.turn) - law.rate * observation[:, 3:6]
        wanted = torch.cat((_cut(force, law.force), _cut(torque, law.torque)), dim=1) @ self.spread
        # As much of what all open together as the one that would pull needs.
        return (
            wanted + torch.amax(-wanted / self.together, dim=1, keepdim=True).clamp(min=0.0) * self.together
        )

    def look(self, observation: np.ndarray, images: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Commands and shares as NumPy, of observations (worlds, n) and images as `ImageInput.taken` gives them."""
        with torch.inference_mode():
            command, shares = self(
                torch.as_tensor(np.asarray(observation, np.float32)), torch.as_tensor(images)
            )
        return command.numpy(), shares.numpy()


class ImageController:
    """Such a network behind the controller interface, for evaluation while it learns."""

    name = "policy"

    def __init__(self, network: ImageNetwork, robot: Robot, task: Task, control_hz: float) -> None:
        """Wrap a network; rate in Hz."""
        self._network, self.image = network, network.plan.image
        self.control_hz = control_hz
        self.estimator, self.observer = None, None
        self.readings: tuple[str, ...] = (self.image.reading,)
        if Observer(robot, task).names[: network.plan.inputs] != MOTION_TERMS:
            raise ConfigError(
                f"a policy that sees is for tasks that observe the own motion alone, not '{task.name}'."
            )

    def reset(self) -> None:
        """There is nothing to forget."""

    def act(self, inputs: Inputs) -> np.ndarray:
        """Choose actuators; see `Controller.act`."""
        images = self.image.taken(inputs.readings[self.image.reading])
        return self._network.look(inputs.observation, images)[0]

    def metadata(self) -> dict[str, Any]:
        """Its kind; an unfinished network has no identity to record."""
        return {"controller": self.name}


def _cut(vectors: torch.Tensor, most: float) -> torch.Tensor:
    """Vectors (worlds, 3) cut to a length."""
    length = torch.sqrt(torch.sum(vectors * vectors, dim=1, keepdim=True) + 1e-12)
    return vectors * torch.clamp(most / length, max=1.0)
