"""Digests of what the core computes: gains, what laws command, observations, and batches of worlds.

Each table has one function, which takes the name of a robot and returns its rows. A pair that is refused has a row as
well: the digest of the words.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_bags.contents import open_bag
from fulmar_core.config.errors import FulmarError
from fulmar_core.config.paths import config_names
from fulmar_core.controllers.classical import gains_of
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import (
    AIR_BEARING,
    CLOCK,
    DIAGNOSTICS,
    METADATA,
    OPERATOR_ACTION,
    ROBOT_INFO,
    STATUS,
    WIRES,
)
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.tasks import Task, load_task
from fulmar_core.tasks.goal import goal_in_float64
from fulmar_core.worlds.scenario import load_scenario
from fulmar_evaluation.rerun.reference_bags import REFERENCES, run_reference
from policy_server.controllers import CONTROLLERS, Choice, load_controller
from tests.freeze.digest import digest
from tests.spaces import shared_space

Rows = dict[str, str]
SEED = 5
WORLDS, STEPS = 4, 6  # of each batch
USUAL = "nominal"  # scenario of laws and observations
# What they report depends on the time of day, or names folders; a clock ticks on until its last listener is gone; how
# often a bearing reports before the first step depends on how fast nodes start.
OF_A_MOMENT = (AIR_BEARING, CLOCK, DIAGNOSTICS, METADATA, OPERATOR_ACTION, ROBOT_INFO, STATUS)
LAWS = tuple(name for name, entry in CONTROLLERS.items() if entry.is_law)


def gains(name: str) -> Rows:
    """Gains of every law of a robot, of its file or derived."""
    robot = load_robot(name)
    fitting = [law for law in LAWS if not all(_refuses(robot, task, law) for task in _tasks_of(robot))]
    return {law: _digest_or_refusal(lambda law=law: gains_of(robot, law)) for law in fitting}


def laws(name: str) -> Rows:
    """What every law of a robot commands in the first steps of every task."""
    robot = load_robot(name)
    return {
        f"{task.name} {law}": _digest_or_refusal(lambda task=task, law=law: _commands(robot, task, law))
        for task in _tasks_of(robot)
        for law in LAWS
        if not _refuses(robot, task, law)
    }


def observations(name: str) -> Rows:
    """What a policy of a robot would observe in the first steps of every task."""
    robot = load_robot(name)
    return {
        task.name: _digest_or_refusal(lambda task=task: _observed(robot, task)) for task in _tasks_of(robot)
    }


def batches(name: str) -> Rows:
    """Everything that moves in a batch of a robot after some steps, for every task and scenario."""
    robot = load_robot(name)
    return {
        f"{task.name} {scenario}": _digest_or_refusal(
            lambda task=task, scenario=scenario: _stepped(robot, task, scenario).snapshot()
        )
        for task in _tasks_of(robot)
        for scenario in config_names("scenarios")
    }


def runs(name: str) -> Rows:
    """Every message that moves in lock-step runs of a robot through the deployed nodes, by run and topic."""
    rows = {}
    for reference in REFERENCES:
        if reference.robot == name:
            with tempfile.TemporaryDirectory(prefix="fulmar_freeze_") as folder:
                bag = open_bag(run_reference(reference, Path(folder)))
            for wire in WIRES:
                if wire not in OF_A_MOMENT and len(bag.of(wire)):
                    rows[f"{reference.name} {wire.name}"] = digest(list(bag.of(wire).data))
    return rows


TABLES: dict[str, Callable[[str], Rows]] = {
    each.__name__: each for each in (gains, laws, observations, batches, runs)
}


def _tasks_of(robot: Robot) -> list[Task]:
    tasks = {name: load_task(name) for name in config_names("tasks")}
    return [tasks[task] for _, task in shared_space({robot.name: robot}, tasks)]


def _digest_or_refusal(compute: Callable[[], Any]) -> str:
    try:
        return digest(compute())
    except FulmarError as error:
        return f"refused {digest(str(error))}"


def _refuses(robot: Robot, task: Task, law: str) -> bool:
    try:
        CONTROLLERS[law].check(robot, task)
    except FulmarError:
        return True
    return False


def _batch(robot: Robot, task: Task, scenario: str, **more: Any) -> BatchSimulation[Any]:
    return BatchSimulation(robot, task, load_scenario(scenario), worlds=WORLDS, seed=SEED, **more)


def _random_steps(batch: BatchSimulation[Any]) -> Iterator[None]:
    draws, scale = np.random.default_rng(SEED), batch.robot.actuators.scale
    for _ in range(STEPS):
        batch.step(draws.uniform(-1.2, 1.2, (WORLDS, len(scale))) * scale)
        yield


def _stepped(robot: Robot, task: Task, scenario: str) -> BatchSimulation[Any]:
    batch = _batch(robot, task, scenario)
    for _ in _random_steps(batch):
        pass
    batch.reset([1])
    return batch


def _observed(robot: Robot, task: Task) -> list[Any]:
    batch = _batch(robot, task, USUAL)
    return [batch.observer.names, batch.observe(), *(batch.observe().copy() for _ in _random_steps(batch))]


def _commands(robot: Robot, task: Task, law: str) -> list[np.ndarray]:
    controller = load_controller(law, robot, task, Choice(robot.timing.control_hz))
    batch = _batch(robot, task, USUAL, control_hz=controller.control_hz, dtype=np.float64)
    loop = ControlLoop(robot, task, controller, robots=WORLDS)
    loop.reset()
    loop.begin(goal_in_float64(batch.goal))
    commands = []
    for number in range(STEPS):
        commands.append(
            loop.act(loop.inputs(batch.measured, {}, round(1e9 * number * loop.dt))).command.copy()
        )
        batch.move(commands[-1])
    return commands
