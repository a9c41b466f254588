"""Policy distillation: one policy learns to answer as the networks of several tasks do.

Each network labels what the common policy meets when it drives itself (Ross et al. 2011, arXiv 1011.0686), and the
policy learns from these answers alone, without rewards (Rusu et al. 2015, arXiv 1511.06295; for one task after another
Traore et al. 2019, arXiv 1907.05855).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import torch
from torch.nn import functional

from fulmar_core.robots.robot import Robot
from fulmar_core.tasks import Task
from fulmar_core.tasks.observation import Observer
from fulmar_core.worlds.scenario import Scenario
from training.joint_policy import JointPolicy
from training.network import DeployedNetwork
from training.vec_env import BatchVecEnv

# Our values, for robots with eight thrusters at four tasks: `fulmar train --continue-with` in docs/training.md.
ROUNDS = 40  # of driving and learning; the first one is driven by the networks of the tasks
STEPS = 25  # control steps of a round in each world
WORLDS = 256  # of each task
MINIBATCHES = 40  # of a round
ROWS = 1024  # of each task in a minibatch
BEYOND = 1.2  # an answer of more than full command counts as so much [-]
RATE = 2e-3  # learning rate to begin with; it falls to 0


class _TaskSamples:
    """Observations of a task, and the answers of the network that learned it."""

    def __init__(self, name: str, network: DeployedNetwork, worlds: BatchVecEnv) -> None:
        self.name, self.network, self._worlds = name, network, worlds
        self._scale = np.asarray(network.plan.command_scale, dtype=np.float32)
        self._seen = worlds.reset()
        self._rows, self._answers = torch.zeros(0, network.plan.inputs), torch.zeros(0, network.plan.outputs)

    @torch.no_grad()
    def drive(self, driver: DeployedNetwork, steps: int) -> None:
        """Let a network drive, and keep what the network of this task answers."""
        met = []
        for _ in range(steps):
            seen = torch.from_numpy(np.asarray(self._seen, dtype=np.float32))
            met.append(self.network.normalised(seen))
            command = driver(seen)[0].numpy()
            self._seen = self._worlds.step(command / self._scale)[0]
        new = torch.cat(met)
        self._rows = torch.cat((self._rows, new))
        self._answers = torch.cat((self._answers, self.network.layers(new)))

    def draw(self, rows: int, generator: torch.Generator) -> tuple[torch.Tensor, torch.Tensor]:
        """Draw normalised observations and answers from all rounds so far."""
        index = torch.randint(len(self._rows), (rows,), generator=generator)
        return self._rows[index], self._answers[index]

    def loss(self, raw: torch.Tensor, answers: torch.Tensor) -> torch.Tensor:
        """Difference of raw outputs from answers."""
        if self.network.plan.decision == "threshold":
            return functional.binary_cross_entropy_with_logits(raw, torch.sigmoid(answers))
        if self.network.plan.decision == "squash":
            return functional.mse_loss(torch.tanh(raw), torch.tanh(answers))
        return functional.mse_loss(raw, torch.clamp(answers, -BEYOND, BEYOND))


def distil(
    networks: Mapping[str, DeployedNetwork],
    robot: Robot,
    tasks: Mapping[str, Task],
    scenarios: Mapping[str, Scenario],
    *,
    hidden: Sequence[int],
    seed: int,
    advance: Callable[[float], None],
) -> dict[str, DeployedNetwork]:
    """Teach one policy what the networks of several tasks know.

    Args:
        networks: Of each task, without memory, mirror, body or fallback.
        robot: The robot.
        tasks: By the same names.
        scenarios: What episodes of each task are drawn from.
        hidden: Sizes of the hidden layers that tasks share.
        seed: Of weights and episodes.
        advance: Called with the share that is done [-].

    Returns:
        The network of each task within the common policy.
    """
    torch.set_num_threads(1)  # as in `train`
    torch.manual_seed(seed)
    generator = torch.Generator().manual_seed(seed)
    sampled = [
        _TaskSamples(
            name, network, BatchVecEnv(robot, tasks[name], scenarios[name], worlds=WORLDS, seed=seed)
        )
        for name, network in networks.items()
    ]
    terms = {name: Observer(robot, tasks[name]).names for name in networks}
    policy = JointPolicy(terms, hidden, next(iter(networks.values())).plan.outputs)
    optimiser = torch.optim.Adam(policy.parameters(), lr=RATE)
    schedule = torch.optim.lr_scheduler.LinearLR(optimiser, 1.0, 0.0, ROUNDS * MINIBATCHES)
    for number in range(ROUNDS):
        for each in sampled:
            each.drive(policy.network_of(each.name, each.network) if number else each.network, STEPS)
        for _ in range(MINIBATCHES):
            losses = []
            for each in sampled:
                rows, answers = each.draw(ROWS, generator)
                losses.append(each.loss(policy(policy.features(each.name, rows)), answers))
            optimiser.zero_grad()
            torch.stack(losses).sum().backward()
            optimiser.step()
            schedule.step()
        advance((number + 1) / ROUNDS)
    return {each.name: policy.network_of(each.name, each.network) for each in sampled}
