"""The simulators that can run a robot."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.basilisk_robots import BASILISK, check_basilisk, is_for_basilisk
from fulmar_core.robots.jsbsim_models import JSBSIM
from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.backend import Backend
from fulmar_core.tasks import Task
from fulmar_core.worlds.scenario import Scenario

CORE, MOCK, MUJOCO = "core", "mock", "mujoco"
THROUGH = {
    CORE: "batch",
    MUJOCO: "mujoco",
    JSBSIM: "jsbsim",
    BASILISK: "basilisk",
}  # ways of `fulmar evaluate`


def simulators_of(robot: Robot) -> tuple[str, ...]:
    """Names of the simulators that have this robot and are installed; the core is the first."""
    return (CORE, MOCK, MUJOCO, *(name for name in (JSBSIM, BASILISK) if name not in missing_of(robot)))


def missing_of(robot: Robot) -> dict[str, str]:
    """Why a simulator that others have is not among them."""
    missing = {}
    if robot.airframe is None:
        missing[JSBSIM] = "flies aircraft only"
    elif find_spec(JSBSIM) is None:
        missing[JSBSIM] = "is not installed: the extra 'jsbsim' brings it"
    if not is_for_basilisk(robot):
        return missing | {BASILISK: "simulates spacecraft and satellites only"}
    try:
        check_basilisk(robot)
    except ConfigError as error:
        missing[BASILISK] = str(error)
    return missing


def maker_of(name: str, robot: Robot, task: Task, scenario: Scenario) -> Callable[[], Backend]:
    """What builds a simulator other than the core.

    Args:
        name: One of `simulators_of`, but the core.
        robot: The robot.
        task: Has the things and structures around it.
        scenario: Says whether sensors are noisy.
    """
    if name == MOCK:
        from sim_nodes.mock_backend import MockBackend

        return lambda: MockBackend(robot, things=task.things)
    if name == MUJOCO:
        from sim_nodes.mujoco_backend import MujocoBackend

        return lambda: MujocoBackend.of(robot, task, scenario)
    if name == BASILISK:
        from sim_nodes.basilisk_backend import BasiliskBackend

        return lambda: BasiliskBackend.of(robot, task, scenario)
    from sim_nodes.jsbsim_backend import JsbsimBackend

    return lambda: JsbsimBackend.of(robot, task, scenario)
