"""Random commands that keep a robot where it may be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.paths import config_names
from fulmar_core.controllers.by_kind import exciting
from fulmar_core.controllers.excite import Excite
from fulmar_core.robots.actuators.reaction_wheels import ReactionWheels
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from tests.inputs import inputs_of, some_of

TASKS = {PlanarState: "go_to_position", SpatialState: "go_to_pose_3d"}


def commands_of(name, *, seconds=90.0, worlds=4):
    robot = load_robot(name)
    task = load_task("point_inertial" if robot.actuators.turns_only else TASKS[robot.state_type])
    simulation = BatchSimulation(robot, task, load_scenario("nominal"), worlds=worlds, seed=3)
    controller = exciting(robot)(robot, task)
    commands, far = [], 0.0
    for step in range(round(seconds * controller.control_hz)):
        stamp = 1_000_000_000 + round(1e9 * step / controller.control_hz)
        simulation.step(controller.act(replace(inputs_of(simulation), stamp_ns=stamp)))
        commands.append(simulation.command[0])
        far = max(far, float(simulation.truth.distance_to(simulation.goal.current).max()))
    return robot, np.array(commands), far


# All are pushed in space; what turns one, turns the others.
ALIKE = {"int_ball2", "cubesat_8"}


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.slow if name in ALIKE else ())
        for name in config_names("robots")
        if not load_robot(name).flies
    ],
)
def test_a_robot_stays_inside_its_geofence_and_uses_all_of_its_actuators(name):
    robot, commands, far = commands_of(name)
    assert far < robot.limits.geofence
    used = np.abs(commands).max(axis=0) / robot.actuators.scale
    wheels = isinstance(robot.actuators, ReactionWheels)
    if wheels:
        used = used[: robot.actuators.count]  # what unloads wheels would spoil what they show
    assert (used > 0.5).all()  # two wheels cannot go and turn at full speed at once
    changes = np.any(np.diff(commands, axis=0) != 0.0, axis=1).mean()
    assert changes > (0.005 if wheels else 0.02)  # heavy flywheels take a minute from end to end


def test_valves_open_alone_and_in_company():
    _, commands, _ = commands_of("floating_platform")
    assert set(commands.sum(axis=1)) == {1.0, 2.0, 3.0}


def test_a_task_without_one_place_is_refused():
    with pytest.raises(ValueError, match="stays around one place"):
        Excite(load_robot("floating_platform"), load_task("track_velocities"))


def test_a_spacecraft_turns_about_every_axis_by_less_than_a_quarter_turn_a_step_and_stays_in_its_room():
    """What identification needs: between two poses, 0.2 s apart, the shorter way round is the true one."""
    robot, task = load_robot("spacecraft_16"), load_task("go_to_pose_3d")
    simulation = BatchSimulation(robot, task, load_scenario("nominal"), worlds=4, seed=3, training=True)
    controller, rates, far = exciting(robot)(robot, task), [], []
    for _ in range(round(90.0 * controller.control_hz)):
        simulation.step(controller.act(inputs_of(simulation)))
        rates.append(np.stack(simulation.truth.rate, axis=-1))
        far.append(simulation.truth.distance_to(simulation.goal.current))
    rates = np.array(rates)
    assert (np.sqrt(np.mean(rates**2, axis=(0, 1))) > 0.08).all()
    assert np.linalg.norm(rates, axis=-1).max() < 1.5
    assert np.max(far[round(60.0 * controller.control_hz) :]) < 0.5 * robot.limits.geofence


def test_a_row_in_space_does_not_depend_on_its_neighbours():
    robot, task = load_robot("spacecraft_16"), load_task("go_to_pose_3d")
    simulation = BatchSimulation(robot, task, load_scenario("nominal"), worlds=3, seed=3)
    inputs = inputs_of(simulation)
    together = exciting(robot)(robot, task).act(inputs)
    assert np.array_equal(exciting(robot)(robot, task).act(some_of(inputs, slice(1, 2))), together[1:2])
