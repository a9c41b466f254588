"""The deployed network of a learner: normalisation and policy, without what only training needs."""

from __future__ import annotations

import copy
import itertools
import pickle
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import torch
from torch import nn

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.disturbance_inputs import ESTIMATOR, with_disturbances
from fulmar_core.controllers.wrench_choice import WRENCH, WrenchChoice
from fulmar_core.controllers.wrench_shares import BODY_TERMS, WrenchShares
from fulmar_core.robots.actuators.pushing import WRENCH as BODY_WRENCH
from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.symmetry import Mirror
from fulmar_core.tasks import Task
from fulmar_core.tasks.observation import Observer
from training.bodies import KnownBodies
from training.dreamer_network import DreamerNetwork, DreamerPlan
from training.image_network import ImageController, ImageNetwork, ImagePlan
from training.incremental_actions import KINDS, incremental_shares
from training.policy_network import PolicyNetwork

Decision = Literal["threshold", "clamp", "squash", "choose", "increment", "allocate"]


@dataclass(frozen=True)
class NetworkPlan:
    """Structure of a deployed network: everything but its numbers."""

    inputs: int  # observation terms
    hidden: tuple[int, ...]  # sizes of the hidden layers
    outputs: int  # of the last layer: actuators, the terms of a wrench, or logits of each actuator's actions
    activation: Literal["tanh", "relu"]
    decision: Decision  # how raw outputs become shares of full command
    command_scale: tuple[float, ...]  # full command of each actuator, in its own unit
    limit: float  # normalised observations are cut to this
    memory: int = 0  # numbers that an LSTM before the hidden layers carries over; 0: there is none
    combinations: int = 0  # of valves, to choose from for a wrench
    disturbances: bool = False  # its last inputs are `disturbance_terms`
    knows_dead: bool = False  # its last inputs are 1 for each valve, or 0 where it is dead
    side: int | None = None  # where this input is negative, input and output are mirrored
    fallback: NetworkPlan | None = None  # of the network that takes over where too many valves are dead
    losses: int = 0  # sets of dead valves of which one is enough for that
    body: bool = False  # its last inputs are `BODY_TERMS`, constants of the robot that it holds itself

    @property
    def answers(self) -> int:
        """Number of shares of full command, or of terms of a wrench, that the outputs become."""
        return self.outputs // KINDS if self.decision == "increment" else self.outputs

    @property
    def observed(self) -> int:
        """Number of observation terms that it is given."""
        return self.inputs - BODY_TERMS if self.body else self.inputs

    @property
    def on_off(self) -> bool:
        """Whether its commands are zeros and ones."""
        return self.decision in ("threshold", "choose")


class DeployedNetwork(PolicyNetwork):
    """Observation in, command and raw outputs out; what `export` writes to ONNX."""

    plan: NetworkPlan
    mean: torch.Tensor
    scale: torch.Tensor
    command_scale: torch.Tensor
    choice_commands: torch.Tensor
    choice_slope: torch.Tensor
    choice_offset: torch.Tensor
    choice_cost: torch.Tensor
    mirror_seen: torch.Tensor
    mirror_done: torch.Tensor
    losses: torch.Tensor
    allocation: torch.Tensor
    resting: torch.Tensor
    limits: torch.Tensor
    body: torch.Tensor

    def __init__(self, plan: NetworkPlan) -> None:
        super().__init__()
        self.plan = plan
        self.register_buffer("mean", torch.zeros(plan.inputs))
        self.register_buffer("scale", torch.ones(plan.inputs))
        self.register_buffer("command_scale", torch.tensor(plan.command_scale, dtype=torch.float32))
        count, valves = plan.combinations, len(plan.command_scale)
        if count:
            self.register_buffer("choice_commands", torch.zeros(count, valves))
            self.register_buffer("choice_slope", torch.zeros(WRENCH, count))
            self.register_buffer("choice_offset", torch.zeros(count))
            self.register_buffer("choice_cost", torch.zeros(count))
        if plan.side is not None:
            self.register_buffer("mirror_seen", torch.eye(plan.inputs))
            self.register_buffer("mirror_done", torch.eye(plan.answers))
        if plan.losses:
            self.register_buffer("losses", torch.ones(plan.losses, valves))
        if plan.decision == "allocate":
            self.register_buffer("allocation", torch.zeros(valves, BODY_WRENCH))
            self.register_buffer("resting", torch.ones(valves))
            self.register_buffer("limits", torch.ones(BODY_WRENCH))
            self.register_buffer("body", torch.zeros(BODY_TERMS))
        self.fallback = DeployedNetwork(plan.fallback) if plan.fallback else None
        units = plan.memory // 2
        self.from_input = nn.Linear(plan.inputs, 4 * units) if units else None
        self.from_memory = nn.Linear(units, 4 * units) if units else None
        sizes = [units or plan.inputs, *plan.hidden, plan.outputs]
        layers: list[nn.Module] = []
        for inputs, outputs in itertools.pairwise(sizes):
            layers += [nn.Linear(inputs, outputs), nn.Tanh() if plan.activation == "tanh" else nn.ReLU()]
        self.layers = nn.Sequential(*layers[:-1])
        self.eval()

    def forward(
        self, observation: torch.Tensor, memory: torch.Tensor | None = None
    ) -> tuple[torch.Tensor, ...]:
        """Choose commands.

        Args:
            observation: Raw terms, shape (worlds, n).
            memory: What it returned the time before, zeros at first, shape (worlds, `plan.memory`); only if it has
                memory.

        Returns:
            Commands in the actuators' units and the raw outputs behind them, both of shape (worlds, m), and the next
            memory if it has any.
        """
        if self.plan.body:
            observation = torch.cat((observation, self.body.expand(observation.shape[0], -1)), dim=1)
        seen = self._mirrored(observation, observation, "seen")
        features = self.normalised(seen)
        if memory is None:
            raw = self._mirrored(self._incremental(self.layers(features), seen), observation, "done")
            raw = self._handed_over(self._valve_margins(raw, observation), observation)
            return self._decide(raw), raw
        memory = self._remember(features, memory)
        raw = self._valve_margins(self.layers(memory[:, : self.plan.memory // 2]), observation)
        return self._decide(raw), raw, memory

    def normalised(self, observation: torch.Tensor) -> torch.Tensor:
        """Observations as the layers are given them, shape (worlds, n)."""
        return torch.clamp((observation - self.mean) / self.scale, -self.plan.limit, self.plan.limit)

    def _remember(self, features: torch.Tensor, memory: torch.Tensor) -> torch.Tensor:
        """One step of an LSTM: its output and its cell, side by side (Hochreiter and Schmidhuber 1997)."""
        assert self.from_input is not None
        assert self.from_memory is not None
        output, cell = memory.split(self.plan.memory // 2, dim=1)
        gates = self.from_input(features) + self.from_memory(output)
        take, keep, new, show = gates.split(self.plan.memory // 2, dim=1)
        cell = torch.sigmoid(keep) * cell + torch.sigmoid(take) * torch.tanh(new)
        return torch.cat((torch.sigmoid(show) * torch.tanh(cell), cell), dim=1)

    def _mirrored(
        self, rows: torch.Tensor, observation: torch.Tensor, kind: Literal["seen", "done"]
    ) -> torch.Tensor:
        """Rows of observations or actions, mirrored where the goal asks for it."""
        if self.plan.side is None:
            return rows
        matrix = self.mirror_seen if kind == "seen" else self.mirror_done
        mirrored = observation[:, self.plan.side : self.plan.side + 1] < 0.0
        return torch.where(mirrored, rows @ matrix, rows)

    def take_mirror(self, mirror: Mirror) -> None:
        """Copy the mirror matrices."""
        self.mirror_seen.copy_(torch.as_tensor(mirror.seen))
        self.mirror_done.copy_(torch.as_tensor(mirror.done))

    def take_choice(self, choice: WrenchChoice) -> None:
        """Copy the table that valves are chosen from."""
        self.choice_commands.copy_(torch.as_tensor(choice.commands))
        self.choice_slope.copy_(torch.as_tensor(choice.slope))
        self.choice_offset.copy_(torch.as_tensor(choice.offset))
        self.choice_cost.copy_(torch.as_tensor(choice.valve_costs))

    def take_bodies(self, bodies: KnownBodies) -> None:
        """Copy the allocation and the terms of a body."""
        for mine, theirs in self._own_body(bodies).items():
            getattr(self, mine).copy_(theirs)

    def for_bodies(self, bodies: KnownBodies) -> DeployedNetwork:
        """The same weights for bodies that differ from row to row of what is observed; it cannot be saved."""
        twin = copy.copy(self)
        twin._buffers = {**self._buffers, **self._own_body(bodies)}
        return twin

    def for_robot(self, robot: Robot) -> DeployedNetwork:
        """The same weights for another robot.

        Raises:
            ConfigError: The network asks for no wrench, or none can be allocated to the robot's actuators.
        """
        if self.plan.decision != "allocate":
            raise ConfigError(
                f"the network gives commands of single actuators, not a wrench, so it is not for '{robot.name}'. Train "
                "with 'action_space: wrench' and 'body_inputs: true'."
            )
        try:
            bodies = KnownBodies.of_robot(robot)
        except ValueError as error:
            raise ConfigError(str(error)) from None
        scale = tuple(map(float, robot.actuators.scale))
        other = DeployedNetwork(replace(self.plan, command_scale=scale))
        own = {name for name in self.state_dict() if name in (*self._own_body(bodies), "command_scale")}
        other.load_state_dict({k: v for k, v in self.state_dict().items() if k not in own}, strict=False)
        other.take_bodies(bodies)
        return other

    @staticmethod
    def _own_body(bodies: KnownBodies) -> dict[str, torch.Tensor]:
        shares = bodies.shares
        parts = (shares.openings_per_wrench, shares.resting, shares.limits, torch.from_numpy(bodies.terms))
        return dict(zip(("allocation", "resting", "limits", "body"), parts, strict=True))

    def take_fallback(self, fallback: DeployedNetwork, losses: np.ndarray) -> None:
        """Copy the policy that acts where all valves of a row of `losses` are dead (1), shape (k, valves)."""
        assert self.fallback is not None
        self.fallback.load_state_dict(fallback.state_dict())
        self.losses.copy_(torch.as_tensor(losses))

    def _handed_over(self, raw: torch.Tensor, observation: torch.Tensor) -> torch.Tensor:
        """Outputs, of the fallback policy where it takes over."""
        if self.fallback is None:
            return raw
        dead = 1.0 - observation[:, -self.losses.shape[1] :]
        missing = self.losses.sum(dim=1) - dead @ self.losses.t()
        return torch.where(missing.amin(dim=1, keepdim=True) < 0.5, self.fallback(observation)[1], raw)

    def _incremental(self, raw: torch.Tensor, seen: torch.Tensor) -> torch.Tensor:
        """Shares of full command of the likeliest incremental actions; other outputs as they are."""
        if self.plan.decision != "increment":
            return raw
        actions = raw.unflatten(1, (self.plan.answers, KINDS)).argmax(2).to(raw.dtype) - 1.0
        return torch.as_tensor(incremental_shares(actions, seen[:, -self.plan.answers :]))

    def _valve_margins(self, raw: torch.Tensor, observation: torch.Tensor) -> torch.Tensor:
        """Margin for opening each valve, or how far, where the last layer gives a wrench; other outputs as they are."""
        if self.plan.decision == "allocate":
            shares = WrenchShares(self.allocation, self.resting, self.limits)
            return shares.openings(torch.clamp(raw, -1.0, 1.0))
        if self.plan.decision != "choose":
            return raw
        choice = WrenchChoice(
            self.choice_commands, self.choice_slope, self.choice_offset, self.choice_cost, torch.ones(WRENCH)
        )
        valves = len(self.plan.command_scale)
        dead = 1.0 - observation[:, -valves:] if self.plan.knows_dead else None
        return choice.margins(torch.clamp(raw, -1.0, 1.0), dead)

    def _decide(self, raw: torch.Tensor) -> torch.Tensor:
        if self.plan.on_off:
            return (raw > 0.0).to(torch.float32)  # the more likely state of each
        share = torch.tanh(raw) if self.plan.decision == "squash" else torch.clamp(raw, -1.0, 1.0)
        return share * self.command_scale


def save_network(network: PolicyNetwork, path: Path) -> None:
    """Write plan, weights and statistics."""
    torch.save({"plan": asdict(network.plan), "state": network.state_dict()}, path)


def load_network(path: Path) -> PolicyNetwork:
    """Read what `save_network` wrote; tensors and numbers only, no pickled code.

    Raises:
        ConfigError: If the file holds anything else.
    """
    try:
        content = torch.load(path, weights_only=True)
        network = _network_of(content["plan"])
        network.load_state_dict(content["state"])
    except (
        OSError,
        EOFError,
        RuntimeError,
        pickle.UnpicklingError,
        LookupError,
        TypeError,
        ValueError,
        AttributeError,
    ) as error:
        raise ConfigError(
            f"{path}: holds no weights that this version of `fulmar train` wrote ({type(error).__name__})."
        ) from error
    return network


def _network_of(plain: dict[str, Any]) -> PolicyNetwork:
    if "classes" in plain:
        return DreamerNetwork(DreamerPlan(**plain))
    if "image" in plain:
        return ImageNetwork(ImagePlan.from_plain(plain))
    return DeployedNetwork(_plan_of(plain))


def _plan_of(plain: dict[str, Any]) -> NetworkPlan:
    within = plain.get("fallback")
    return NetworkPlan(**plain | {"fallback": _plan_of(within) if within else None})


class NetworkController:
    """A network behind the controller interface, for evaluation while it learns."""

    name = "policy"

    def __init__(self, network: PolicyNetwork, robot: Robot, task: Task, control_hz: float) -> None:
        """Wrap a network; rate in Hz."""
        self._network = network
        self._observer = Observer(robot, task)
        self.control_hz = control_hz
        self._memory: np.ndarray | None = None
        self.estimator = ESTIMATOR if network.plan.disturbances else None
        self.readings: tuple[str, ...] = self._observer.readings
        self.observer = None

    def reset(self) -> None:
        """Clear the memory."""
        self._memory = None

    def act(self, inputs: Inputs) -> np.ndarray:
        """Choose actuators; see `Controller.act`."""
        batch = with_disturbances(self._observer, inputs) if self.estimator else inputs.observation
        if self._memory is not None and len(self._memory) != len(batch):
            self._memory = None
        command, _, self._memory = self._network.infer(batch, self._memory)
        return np.asarray(command)

    def metadata(self) -> dict[str, Any]:
        """Its kind; an unfinished network has no identity to record."""
        return {"controller": self.name}


def controller_of(
    network: PolicyNetwork, robot: Robot, task: Task, control_hz: float
) -> NetworkController | ImageController:
    """A network behind the controller interface; rate in Hz."""
    if isinstance(network, ImageNetwork):
        return ImageController(network, robot, task, control_hz)
    return NetworkController(network, robot, task, control_hz)
