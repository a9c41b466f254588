"""Run folders as a training by DreamerV3 leaves them, with weights that were drawn."""

from __future__ import annotations

import json
from pathlib import Path

import torch

from fulmar_core.robots.robot import Robot
from fulmar_core.tasks import Task
from fulmar_core.tasks.observation import Observer
from training.dreamer_network import DreamerNetwork, DreamerPlan
from training.network import save_network
from training.run_folder import NETWORK_FILE, RUN_FILE


def small_plan(robot: Robot, task: Task) -> DreamerPlan:
    """A network of a few thousand numbers."""
    return DreamerPlan(
        inputs=len(Observer(robot, task).names),
        recurrent=16,
        groups=4,
        classes=4,
        dense=16,
        layers=1,
        command_scale=tuple(float(value) for value in robot.actuators.scale),
    )


def drawn_network(robot: Robot, task: Task) -> DreamerNetwork:
    """Weights at random, and an initial state that is not zero."""
    network = DreamerNetwork(small_plan(robot, task))
    generator = torch.Generator().manual_seed(1)
    with torch.no_grad():
        for weights in network.parameters():
            weights.copy_(torch.randn(weights.shape, generator=generator))
        network.first[:16] = torch.tanh(torch.randn(16, generator=generator))
        network.first[16:32:4] = 1.0
    return network


def write_run(folder: Path, network: DreamerNetwork, robot: Robot, task: Task) -> Path:
    """A finished run with a network."""
    folder.mkdir(parents=True, exist_ok=True)
    save_network(network, folder / NETWORK_FILE)
    record = {"robot": robot.name, "task": task.name, "control_hz": robot.timing.control_hz, "seed": 1}
    made = {"command": "fulmar train", "steps": 8, "wall_s": 1.0, "settings": {}, "best": {}, "versions": {}}
    (folder / RUN_FILE).write_text(json.dumps(record | made))
    return folder
