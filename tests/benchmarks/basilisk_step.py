"""Cost of a control step of one spacecraft in the mock, MuJoCo and Basilisk, over a pipe to its own process.

`python -m tests.benchmarks.basilisk_step` prints a JSON object: milliseconds of a control step by robot and simulator,
and of a reset and the start of Basilisk. The simulators take turns, and of all turns the median counts.
"""

from __future__ import annotations

import json
import statistics
import sys
import time
from collections.abc import Callable
from functools import partial

import numpy as np

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.backend import Backend
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.worlds.scenario import load_scenario
from sim_nodes.basilisk_backend import BasiliskBackend
from sim_nodes.mock_backend import MockBackend
from sim_nodes.mujoco_backend import MujocoBackend
from tests.spaces import task_for

ROBOTS = ("spacecraft_16", "cubesat_wheels")
TURNS, STEPS = 9, 50


def timed(action: Callable[[], object]) -> float:
    """How long it takes [ms]."""
    begun = time.perf_counter()
    action()
    return 1e3 * (time.perf_counter() - begun)


def step_all(backend: Backend, commands: list[np.ndarray], ticks: int) -> None:
    """Take one control step for each command."""
    for command in commands:
        backend.step(command, ticks)


def costs(name: str) -> dict[str, float]:
    """Medians of one robot [ms]."""
    robot = load_robot(name)
    rng, ticks = np.random.default_rng(0), robot.timing.substeps(robot.timing.control_hz)
    episode = draw_episode(robot, task_for(robot, "go_to_pose"), load_scenario("nominal"), seed=0, number=0)
    backends: dict[str, Backend] = {"mock": MockBackend(robot), "mujoco": MujocoBackend(robot)}
    found = {"start_of_basilisk": timed(lambda: backends.update(basilisk=BasiliskBackend(robot)))}
    turns: dict[str, list[float]] = {}
    for _ in range(TURNS):
        commands = [robot.actuators.limited(rng.normal(0.0, robot.actuators.scale)) for _ in range(STEPS)]
        for key, backend in backends.items():
            turns.setdefault(f"{key}_reset", []).append(timed(partial(backend.reset, episode, seed=0)))
            took = timed(partial(step_all, backend, commands, ticks))
            turns.setdefault(key, []).append(took / STEPS)
    for backend in backends.values():
        backend.close()
    return found | {key: statistics.median(values) for key, values in turns.items()}


if __name__ == "__main__":
    sys.stdout.write(json.dumps({name: costs(name) for name in ROBOTS}, indent=2) + "\n")
