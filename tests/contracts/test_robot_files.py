"""What every robot's YAML promises."""

from __future__ import annotations

import json
from dataclasses import asdict

import numpy as np
import pytest

from fulmar_core.dynamics.contact import outline_of
from fulmar_core.robots.actuators.ackermann import Ackermann
from fulmar_core.robots.actuators.pushing import Pushing
from fulmar_core.robots.actuators.reaction_wheels import ReactionWheels
from fulmar_core.robots.actuators.rolling import Rolling
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.wires.silence import default_timeout
from fulmar_core.worlds.scenario import load_scenario
from sim_nodes.mock_backend import MockBackend
from tests.new_robots import robots_of_every_family
from tests.spaces import task_for

ROBOTS = robots_of_every_family()
WHEELED = {name: robot for name, robot in ROBOTS.items() if isinstance(robot.actuators, Rolling)}
FLOATING = {name: robot for name, robot in ROBOTS.items() if isinstance(robot.actuators, Pushing)}
SATELLITES = {name: robot for name, robot in ROBOTS.items() if isinstance(robot.actuators, ReactionWheels)}
EACH = pytest.mark.parametrize("robot", ROBOTS.values(), ids=ROBOTS)
EACH_THAT_ROLLS = pytest.mark.parametrize("robot", WHEELED.values(), ids=WHEELED)
EACH_SATELLITE = pytest.mark.parametrize("robot", SATELLITES.values(), ids=SATELLITES)
EACH_THAT_FLOATS = pytest.mark.parametrize("robot", FLOATING.values(), ids=FLOATING)
IDEAL = load_scenario("ideal")


def pose_of(robot):
    """The task of going to a pose, in the robot's own space."""
    return task_for(robot, "go_to_pose")


def wrench(robot, command):
    """Force ahead, to the left, and yaw moment of one command."""
    column = np.asarray(command, dtype=float)[:, None]
    return np.array([part[0] for part in robot.actuators.planar_wrench(column, np.ones_like(column))])


def corners(robot):
    """Commands with every actuator at an end of its range, or safe: all there are, up to 500."""
    each = [0.0, 1.0] if robot.actuators.one_way else [-1.0, 0.0, 1.0]
    count = len(robot.actuators.names)
    ends = np.array(np.meshgrid(*([each] * count))).reshape(count, -1)
    some = (
        ends.T if ends.shape[1] <= 500 else ends.T[np.random.default_rng(1).permutation(ends.shape[1])[:500]]
    )
    return robot.actuators.limited(some * robot.actuators.scale)


@EACH
def test_it_has_a_title_and_actuators_with_names_of_their_own(robot):
    assert robot.title
    assert len(set(robot.actuators.names)) == len(robot.actuators.names) > 0
    assert robot.actuators.scale.shape == robot.actuators.safe_command.shape == (len(robot.actuators.names),)


@EACH
def test_its_radius_goes_around_its_footprint(robot):
    if robot.body.footprint is not None:
        assert robot.body.radius == pytest.approx(0.5 * np.hypot(*robot.body.footprint), abs=0.01)


@EACH
def test_its_safe_command_is_within_its_limits_and_moves_nothing(robot):
    safe = robot.actuators.safe_command
    np.testing.assert_array_equal(robot.actuators.limited(safe), safe)
    if robot.flies:  # surfaces are neutral and throttles idle, and it glides
        return
    simulation = BatchSimulation(robot, pose_of(robot), IDEAL, worlds=1, seed=1)
    x = simulation.truth.x.copy()
    for _ in range(5):
        simulation.step(safe[None])
    np.testing.assert_array_equal(simulation.truth.x, x)


@EACH
def test_commands_of_many_worlds_stay_side_by_side_in_memory(robot):
    """Interleaved ones would make a compiled step, which reads sixteen worlds at once, half as fast."""
    commands = np.ones((len(robot.actuators.names), 5), dtype=np.float32)
    assert np.asarray(robot.actuators.limited(commands.T)).T.flags.c_contiguous


@EACH
def test_full_commands_stay_full_and_nothing_goes_beyond(robot):
    commands = corners(robot)
    assert np.all(np.abs(commands) <= robot.actuators.scale + 1e-12)
    np.testing.assert_allclose(robot.actuators.limited(commands), commands, rtol=0, atol=1e-12)


@EACH_THAT_FLOATS
def test_force_and_torque_of_its_performance_are_those_of_its_actuators(robot):
    wrenches = np.array([wrench(robot, command) for command in corners(robot)])
    wrenches = np.concatenate((wrenches, [wrench(robot, one) for one in np.eye(len(robot.actuators.names))]))
    assert np.hypot(wrenches[:, 0], wrenches[:, 1]).max() == pytest.approx(robot.performance.force, rel=0.01)
    assert np.abs(wrenches[:, 2]).max() == pytest.approx(robot.performance.torque, rel=0.01)


@EACH_THAT_FLOATS
def test_it_can_push_and_turn_every_way_that_tasks_ask_for(robot):
    wrenches = np.array([wrench(robot, command) for command in corners(robot)])
    ways = [0, 1, 2] if robot.performance.lateral_speed > 0.0 else [0, 2]
    for way in ways:
        assert wrenches[:, way].min() < 0.0 < wrenches[:, way].max()
    if robot.actuators.one_way:
        assert np.linalg.matrix_rank(robot.actuators.wrench_per_newton[:, [0, 1, 5]]) == 3


@EACH_THAT_FLOATS
def test_its_nozzles_propellers_and_fans_sit_on_the_body(robot):
    for push in robot.actuators.pushes:
        x, y, _ = push.position
        # The free-flyer's nozzles stick out by 2 cm: its box and their places are RoboRAN's.
        assert outline_of(robot).gap(np.asarray(x), np.asarray(y)) <= 0.03


@EACH_SATELLITE
def test_its_wheels_turn_it_about_every_axis_as_its_performance_says(robot):
    wheels = robot.actuators
    torques = wheels.scale[: wheels.count, None] * wheels.torque_per_command[: wheels.count]
    assert np.linalg.matrix_rank(torques) == 3
    assert np.abs(torques).sum(axis=0)[2] == pytest.approx(robot.performance.torque)
    slew = robot.performance.yaw_rate * max(robot.body.inertia)
    assert slew < wheels.top_momentum
    assert max(robot.body.inertia) * 1e-5 < wheels.spin_inertia < min(robot.body.inertia)


@EACH_THAT_ROLLS
def test_its_wheels_sit_within_its_outline_and_reach_its_speeds(robot):
    wheels, can = robot.actuators, robot.performance
    assert 0.5 * wheels.track <= 0.5 * (robot.body.footprint or (0.0, 2 * robot.body.radius))[1]
    assert can.top_speed == wheels.max_speed
    if isinstance(wheels, Ackermann):
        assert can.force == wheels.wheel_force
        assert can.yaw_rate <= can.reverse_speed * np.tan(wheels.max_steering) / wheels.wheelbase + 1.0
    else:
        assert can.force == pytest.approx(2.0 * wheels.wheel_force)
        assert can.torque == pytest.approx(wheels.wheel_force * wheels.track, rel=0.01)
        assert can.yaw_rate <= wheels.max_yaw_rate
        outer = can.speed + 0.5 * wheels.track * can.yaw_rate
        assert outer <= wheels.max_wheel_speed * wheels.wheel_radius


def test_the_boat_can_hold_every_velocity_that_tasks_ask_of_it():
    boat = ROBOTS["kingfisher"]
    can, arm = boat.performance, abs(boat.actuators.lever_arms[0])
    for u in (-can.reverse_speed, can.speed):
        for r in (-can.yaw_rate, can.yaw_rate):
            drag = boat.hydrodynamics.planar_damping(np.asarray(u), np.asarray(0.0), np.asarray(r))
            each = np.array([-drag[0] / 2 + drag[2] / (2 * arm), -drag[0] / 2 - drag[2] / (2 * arm)])
            assert each.min() >= boat.actuators.curve[0]
            assert each.max() <= boat.actuators.curve[-1]


@EACH
def test_what_tasks_ask_for_lies_within_what_gates_believe(robot):
    can, limits = robot.performance, robot.limits
    assert max(can.speed, can.reverse_speed) <= can.top_speed < limits.speed or robot.actuators.turns_only
    assert can.yaw_rate < limits.yaw_rate


@EACH
def test_full_commands_for_a_second_stay_within_its_believable_limits(robot):
    commands = corners(robot)
    simulation = BatchSimulation(robot, pose_of(robot), IDEAL, worlds=len(commands), seed=1)
    for _ in range(round(1.0 / simulation.control_dt)):
        simulation.step(commands)
    logged = simulation.truth.logged()
    assert logged["speed"].max() < robot.limits.speed
    assert np.abs(logged["yaw_rate"]).max() < robot.limits.yaw_rate


@EACH
def test_commands_come_twice_before_the_watchdog_trips_or_at_least_once(robot):
    assert default_timeout(1.0 / robot.timing.control_hz) > 1.0 / robot.timing.control_hz


@EACH
def test_it_moves_in_the_mock(robot):
    backend = MockBackend(robot)
    backend.reset(draw_episode(robot, pose_of(robot), IDEAL, seed=1, number=0), seed=1)
    full = robot.actuators.limited(robot.actuators.scale * np.eye(len(robot.actuators.names))[0])
    sample = backend.step(full, 20)
    moved = np.append(sample.truth.velocity_in_world, sample.truth.angular_velocity_in_body)
    assert np.linalg.norm(moved) > 0.0


@EACH
def test_it_compiles_in_mujoco(robot):
    pytest.importorskip("mujoco")
    from sim_nodes.mujoco_model import build_model

    wheels = robot.actuators.wheel_names if robot.name in SATELLITES else robot.actuators.names
    assert build_model(robot).nu >= (
        0 if robot.flies else len(wheels)
    )  # the air pushes no actuator of MuJoCo


@EACH
def test_it_can_be_written_into_a_record(robot):
    json.dumps(asdict(robot), allow_nan=False)
