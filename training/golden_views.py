"""Golden vectors of a policy that sees: a few views, since each is as large as thousands of observations."""

from __future__ import annotations

import numpy as np

from fulmar_core.config.seeds import HELD_OUT_SEED
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.loop.policy_bundle import Golden
from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.tasks import Task
from fulmar_core.tasks.goal import goal_in_float64
from fulmar_core.worlds.scenario import load_scenario
from training.image_network import ImageController, ImageNetwork

FLIGHTS, MOMENTS_S = 4, (0.0, 8.0)  # vectors are taken from each flight at these times


def golden_views(network: ImageNetwork, robot: Robot, task: Task) -> Golden:
    """Vectors of held-out flights, at their start and on the way.

    Raises:
        ConfigError: Nothing can draw images here.
    """
    from sim_nodes.sight import CameraSight  # only here: other networks are exported without a renderer

    simulation = BatchSimulation(robot, task, load_scenario("nominal"), worlds=FLIGHTS, seed=HELD_OUT_SEED)
    controller = ImageController(network, robot, task, robot.timing.control_hz)
    loop = ControlLoop(robot, task, controller, robots=FLIGHTS)
    loop.begin(goal_in_float64(simulation.goal))
    image, taken = network.plan.image, []
    with CameraSight(robot, task, image.camera) as sight:
        for number in range(round(MOMENTS_S[-1] / loop.dt) + 1):
            seen = sight(simulation.truth, simulation.things)
            inputs = loop.inputs(simulation.measured, seen, round(1e9 * number * loop.dt))
            if number in [round(moment / loop.dt) for moment in MOMENTS_S]:
                taken.append((inputs.observation.astype(np.float32), image.taken(seen[image.reading])))
            simulation.move(loop.act(inputs).command)
    observations, images = (np.concatenate(parts) for parts in zip(*taken, strict=True))
    commands, shares = network.look(observations, images)
    none = np.zeros((len(observations), 0), np.float32)
    return Golden(observations, none, commands, shares, none, images)
