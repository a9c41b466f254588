"""Random commands that keep a robot where it may be."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.controllers.excite import Excite
from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.errors import ConfigError
from fulmar_core.paths import config_names
from fulmar_core.planar import PlanarState
from fulmar_core.robot import load_robot
from fulmar_core.simulation import BatchSimulation
from fulmar_core.tasks import load_task
from policy_server.controllers import CONTROLLERS
from tests.inputs import inputs_of
from tests.spaces import task_for

TASK = load_task("go_to_position")


def commands_of(name, *, seconds=90.0, worlds=4):
    robot = load_robot(name)
    simulation = BatchSimulation(robot, TASK, load_scenario("nominal"), worlds=worlds, seed=3)
    controller = Excite(robot, TASK)
    commands, far = [], 0.0
    for _ in range(round(seconds * controller.control_hz)):
        simulation.step(controller.act(inputs_of(simulation)))
        commands.append(simulation.command[0])
        goal = simulation.goal.current
        far = max(
            far, float(np.hypot(simulation.truth.x - goal[:, 0], simulation.truth.y - goal[:, 1]).max())
        )
    return robot, np.array(commands), far


ROBOTS = {name: load_robot(name) for name in config_names("robots")}
IN_PLANE = [name for name, robot in ROBOTS.items() if robot.state_type is PlanarState]


@pytest.mark.parametrize("name", IN_PLANE)
def test_a_robot_stays_inside_its_geofence_and_uses_all_of_its_actuators(name):
    robot, commands, far = commands_of(name)
    assert far < robot.limits.geofence
    used = np.abs(commands).max(axis=0) / robot.actuators.scale
    assert (used > 0.5).all()  # two wheels cannot go and turn at full speed at once
    changes = np.any(np.diff(commands, axis=0) != 0.0, axis=1).mean()
    assert changes > 0.02


def test_valves_open_alone_and_in_company():
    _, commands, _ = commands_of("floating_platform")
    assert set(commands.sum(axis=1)) == {1.0, 2.0, 3.0}


def test_a_task_without_one_place_is_refused():
    with pytest.raises(ValueError, match="stays around one place"):
        Excite(load_robot("floating_platform"), load_task("track_velocities"))


@pytest.mark.parametrize("name", [name for name in ROBOTS if name not in IN_PLANE])
def test_robots_in_space_are_refused(name):
    with pytest.raises(ConfigError, match=f"is for robots in the plane; '{name}' floats in space"):
        CONTROLLERS["excite"].check(ROBOTS[name], task_for(ROBOTS[name], "go_to_position"))
