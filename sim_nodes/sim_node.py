"""The process that simulates a robot: a simulator or the mock behind the plant's wires."""

from __future__ import annotations

import sys

from fulmar_core.config.errors import UnknownNameError
from fulmar_core.robots.basilisk_robots import BASILISK
from fulmar_core.robots.jsbsim_models import JSBSIM, is_jsbsim, jsbsim_model
from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.backend import Backend
from fulmar_core.simulation.disturbed import disturbed
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from fulmar_ros.plant_node import PlantNode
from fulmar_ros.plant_settings import PlantSettings
from fulmar_ros.runtime import run_node
from sim_nodes.camera.opengl import check_variable
from sim_nodes.jsbsim_loadable import check_jsbsim
from sim_nodes.on_air import CanStand, OnAir

BACKENDS = ("mujoco", "mock", JSBSIM, BASILISK)


def make_backend(robot: Robot, settings: PlantSettings) -> Backend:
    """Build the backend that the parameters name, on air where the robot has a bearing."""
    backend = _simulator(robot, settings)
    return disturbed(OnAir(backend, load_scenario(settings.scenario)) if robot.air_bearing else backend)


def _simulator(robot: Robot, settings: PlantSettings) -> CanStand:
    """The simulator that the parameters name; only that one is imported."""
    task = load_task(settings.task, settings.thing)
    if settings.backend == "mujoco":
        check_variable()
        from sim_nodes.mujoco_backend import MujocoBackend

        return MujocoBackend.of(robot, task, load_scenario(settings.scenario))
    if settings.backend == "mock":
        from sim_nodes.mock_backend import MockBackend

        return MockBackend(robot, things=task.things)
    if is_jsbsim(settings.backend):
        check_jsbsim()
        from sim_nodes.jsbsim_backend import JsbsimBackend

        model = jsbsim_model(robot, settings.backend)
        return JsbsimBackend.of(robot, task, load_scenario(settings.scenario), model)
    if settings.backend == BASILISK:
        from sim_nodes.basilisk_backend import BasiliskBackend

        return BasiliskBackend.of(robot, task, load_scenario(settings.scenario))
    raise UnknownNameError("simulated backend", settings.backend, BACKENDS)


def main() -> None:
    """Run the node until it is stopped."""
    sys.exit(run_node(lambda request_exit: PlantNode(make_backend, request_exit)))


if __name__ == "__main__":
    main()
