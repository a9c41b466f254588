"""What every simulator promises of parts that stick and of supplies that fall, within an episode."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.basilisk_robots import is_for_basilisk
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.worlds.parts import Actuation, Stuck, Supply
from fulmar_core.worlds.scenario import load_scenario
from fulmar_core.worlds.stuck import candidates_of
from sim_nodes.mock_backend import MockBackend
from tests.basilisk import with_basilisk
from tests.new_robots import robots_of_every_family
from tests.spaces import task_for

NAMES = (
    "floating_platform",
    "spacecraft_16",
    "fan_disc",
    "kingfisher",
    "turtlebot2",
    "leatherback",
    "cubesat_wheels",
    "airship_v7",
)
ROBOTS = {name: robots_of_every_family()[name] for name in NAMES}  # each family in each space
IDEAL = load_scenario("ideal")
STEPS = 8  # control steps
SCENARIOS = {
    "valve_stuck_open": ["floating_platform", "spacecraft_16", "cubesat_8", "int_ball2"],
    "valve_stuck_closed": ["floating_platform", "spacecraft_16", "cubesat_8", "int_ball2"],
    "surface_stuck": ["airship_v7", "navion"],
    "wheel_dead": ["cubesat_wheels", "turtlebot2"],
    "propeller_lost": ["kingfisher", "airship_v7", "cessna_182"],
    "supply_falls": ["floating_platform", "kingfisher", "airship_v7"],
}


def batch_of(robot, scenario, command, steps):
    """States of the core's batch after each control step, shape (steps, columns)."""
    batch = BatchSimulation(
        robot, task_for(robot, "go_to_pose"), scenario, worlds=2, seed=3, dtype=np.float64
    )
    states = []
    for _ in range(steps):
        batch.move(np.tile(command, (2, 1)))
        states.append(np.array([column[1] for column in batch.truth.columns()]))
    return np.array(states)


def backend_of(build):
    def states_of(robot, scenario, command, steps):
        backend = build(robot)
        episode = draw_episode(robot, task_for(robot, "go_to_pose"), scenario, seed=3, number=1)
        backend.reset(episode, seed=3, number=1)
        ticks = robot.timing.substeps(robot.timing.control_hz)
        truths = [backend.step(command, ticks).truth for _ in range(steps)]
        backend.close()
        parts = ("position_in_world", "quat_xyzw", "velocity_in_world", "angular_velocity_in_body")
        return np.array([np.concatenate([getattr(truth, part) for part in parts]) for truth in truths])

    return states_of


def mujoco(robot):
    pytest.importorskip("mujoco")
    from sim_nodes.mujoco_backend import MujocoBackend

    return MujocoBackend(robot, sensor_noise=False)


def jsbsim(robot):
    pytest.importorskip("jsbsim")
    from sim_nodes.jsbsim_backend import JsbsimBackend

    return JsbsimBackend(robot, sensor_noise=False)


def basilisk(robot):
    return with_basilisk(robot, sensor_noise=False)


SIMULATORS = {
    "batch": batch_of,
    "mock": backend_of(MockBackend),
    "mujoco": backend_of(mujoco),
    "jsbsim": backend_of(jsbsim),
    "basilisk": backend_of(basilisk),
}
IS_FOR = {"jsbsim": lambda robot: robot.flies, "basilisk": is_for_basilisk}
PAIRS = [
    pytest.param(simulator, name, marks=pytest.mark.slow if simulator == "basilisk" else ())
    for simulator in SIMULATORS
    for name in sorted(ROBOTS)
    if simulator not in IS_FOR or IS_FOR[simulator](ROBOTS[name])
]
EACH = pytest.mark.parametrize(("simulator", "name"), PAIRS)


def sticking(robot, at, from_s, number=0):
    """The ideal scenario, with a part of a robot that sticks."""
    stuck = Stuck((robot.actuators.parts.names[number],), at, (from_s, from_s))
    return replace(IDEAL, actuation=Actuation(stuck=stuck))


def command_of_part(robot, at, number=0):
    """The command that moves one part to a share of its largest value, and all others nowhere."""
    parts = robot.actuators.parts
    values = np.zeros(len(parts.names))
    values[number] = at * parts.scale[number]
    return values if parts.per_command is None else np.linalg.solve(parts.per_command, values)


@EACH
def test_a_part_that_sticks_moves_the_robot_as_if_it_were_commanded_so(simulator, name):
    robot, states = ROBOTS[name], SIMULATORS[simulator]
    stuck = states(robot, sticking(robot, 1.0, 0.0), robot.actuators.safe_command, STEPS)
    commanded = states(robot, IDEAL, command_of_part(robot, 1.0), STEPS)
    np.testing.assert_allclose(stuck, commanded, rtol=1e-9, atol=1e-9)
    untouched = states(robot, IDEAL, robot.actuators.safe_command, STEPS)
    assert np.abs(stuck - untouched).max() > 1e-7


@EACH
def test_a_part_that_is_dead_ignores_its_command_from_its_time_on(simulator, name):
    robot, states = ROBOTS[name], SIMULATORS[simulator]
    control_s = robot.timing.control_s
    command = command_of_part(robot, 1.0)
    late = states(robot, sticking(robot, 0.0, 100.0), command, STEPS)
    np.testing.assert_allclose(late, states(robot, IDEAL, command, STEPS), rtol=1e-9, atol=1e-9)
    dying = states(robot, sticking(robot, 0.0, 4.0 * control_s), command, STEPS)
    np.testing.assert_allclose(dying[:4], late[:4], rtol=1e-9, atol=1e-9)
    assert np.abs(dying[4:] - late[4:]).max() > 1e-7


@EACH
def test_actuators_do_less_as_their_supply_falls(simulator, name):
    robot, states = ROBOTS[name], SIMULATORS[simulator]
    control_s = robot.timing.control_s
    command = command_of_part(robot, 1.0)
    falling = Actuation(supply=Supply(0.1, 3.0 * control_s, 2.0 * control_s))
    full, fallen = (
        states(robot, scenario, command, STEPS) for scenario in (IDEAL, replace(IDEAL, actuation=falling))
    )
    np.testing.assert_allclose(fallen[:3], full[:3], rtol=1e-9, atol=1e-9)
    assert np.abs(fallen[3:] - full[3:]).max() > 1e-7


@pytest.mark.parametrize(
    ("scenario", "name"), [(key, robot) for key in SCENARIOS for robot in SCENARIOS[key]]
)
def test_a_scenario_of_it_changes_how_its_robots_move(scenario, name):
    robot, ends = load_robot(name), []
    changes = load_scenario(scenario).actuation
    soon = replace(
        changes, stuck=replace(changes.stuck, from_s=(0.1, 0.3)), supply=replace(changes.supply, from_s=0.1)
    )
    own = replace(IDEAL, actuation=soon)
    # Three valves are open; an aircraft flies with neutral surfaces, and all else goes ahead.
    share = (np.arange(len(robot.actuators.names)) < 3) if robot.actuators.one_way else 0.3
    command = share * robot.actuators.scale
    if scenario == "valve_stuck_open" or robot.flies:
        command[: robot.actuators.positions or None] = 0.0
    for each in (own, replace(own, actuation=Actuation())):
        batch = BatchSimulation(robot, task_for(robot, "go_to_pose"), each, worlds=16, seed=3)
        for _ in range(math.ceil(1.5 / batch.control_dt)):
            batch.move(np.tile(command, (16, 1)))
        ends.append(np.array(batch.truth.columns()))
    assert (np.abs(ends[0] - ends[1]).max(axis=0) > 1e-4).any()


def test_every_part_sticks_in_some_episode_and_each_within_its_times():
    robot = ROBOTS["floating_platform"]
    scenario = load_scenario("valve_stuck_open")
    task = task_for(robot, "go_to_pose")
    drawn = [draw_episode(robot, task, scenario, seed=0, number=number).world for number in range(200)]
    assert {int(world.stuck_part) for world in drawn} == set(range(8))
    assert all(3.0 <= float(world.stuck_from) <= 6.0 for world in drawn)


def test_a_robot_without_the_part_is_refused_with_the_names_of_its_own():
    stuck = load_scenario("surface_stuck").actuation.stuck
    with pytest.raises(ConfigError, match=r"'turtlebot2' has none of these, but left_wheel, right_wheel"):
        candidates_of(ROBOTS["turtlebot2"], stuck)


def test_a_valve_is_not_stuck_below_closed():
    with pytest.raises(ConfigError, match=r"'thruster_1' of 'floating_platform' moves one way only"):
        candidates_of(ROBOTS["floating_platform"], Stuck(("thruster_1",), -0.5))


def test_a_snapshot_of_a_batch_goes_on_to_the_same_end():
    robot = ROBOTS["floating_platform"]
    build = lambda: BatchSimulation(  # noqa: E731
        robot, task_for(robot, "go_to_pose"), sticking(robot, 1.0, 1.0), worlds=3, seed=1
    )
    command, whole, resumed = np.zeros((3, 8)), build(), build()
    for _ in range(3):
        whole.move(command)
    resumed.restore(whole.snapshot())
    for batch in (whole, resumed):
        for _ in range(5):
            batch.move(command)
    np.testing.assert_array_equal(np.array(whole.truth.columns()), np.array(resumed.truth.columns()))
