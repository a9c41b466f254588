"""Batches of worlds that several tests step."""

from __future__ import annotations

import numpy as np

from fulmar_core.config.paths import config_names
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import Scenario, load_scenario
from tests.spaces import task_for

ROBOTS = {name: load_robot(name) for name in config_names("robots")}
PLATFORM, BASE = ROBOTS["floating_platform"], ROBOTS["turtlebot2"]
POSE = load_task("go_to_pose")
STILL = Scenario("nothing happens", sensor_noise=False, body="nominal")
RANDOMISED = load_scenario("randomised")


def build(scenario=STILL, robot=PLATFORM, task=None, *, worlds=5, seed=3, **kwargs):
    """Worlds of a robot, by default at the pose task of its space."""
    return BatchSimulation(
        robot,
        task or task_for(robot, "go_to_pose"),
        scenario,
        worlds=worlds,
        seed=seed,
        **kwargs,
    )


def commands(simulation, steps, seed=1, worlds=None):
    """Commands for every step; a world gets the same ones in a batch of any size."""
    scale = simulation.robot.actuators.scale
    shape = (worlds or simulation.worlds, steps, len(scale))
    drawn = np.random.default_rng(seed).uniform(-1.2, 1.2, shape).transpose(1, 0, 2)
    return drawn * scale


def run(simulation, steps, **kwargs):
    for command in commands(simulation, steps, **kwargs):
        simulation.step(command)
    return simulation


def differing(one, other):
    return {
        name for name in type(one).COLUMNS if not np.array_equal(getattr(one, name), getattr(other, name))
    }
