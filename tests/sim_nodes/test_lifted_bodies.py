"""Bodies in space that only their actuators hold up: weight, what carries it, and the couple of what spins."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.controllers.by_kind import IN_SPACE
from fulmar_core.dynamics.hover import hover_command
from fulmar_core.robots.actuators.fans import Fan, Fans
from fulmar_core.robots.actuators.response import Response
from fulmar_core.robots.kinds.free_flyer import FREE_FLYER
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.gravity import GRAVITY
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_evaluation.by_kind import CHECKS
from fulmar_evaluation.wrench_limits import wrench_set_of
from sim_nodes.mock_backend import MockBackend
from sim_nodes.mujoco_backend import MujocoBackend

BALL = load_robot("int_ball2")
LEVEL = (0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 1.0, *(0.0,) * 6)
ARM, COUPLE = 0.08, 0.02  # m
BACKENDS = pytest.mark.parametrize("backend", [MockBackend, MujocoBackend])


class Lifters(Fans):
    """Fans that blow down, each with a couple; neighbours spin opposite ways."""

    @functools.cached_property
    def pushes(self):
        return tuple(replace(fan.push, couple=(-1) ** i * COUPLE) for i, fan in enumerate(self.fans))


def lifted(thrust_of_weight=2.0, **body):
    """A ball that four fans carry, with so many times its weight in thrust."""
    places = ((ARM, 0.0, 0.0), (0.0, ARM, 0.0), (-ARM, 0.0, 0.0), (0.0, -ARM, 0.0))
    fans = tuple(Fan(f"fan_{i}", place, (0.0, 0.0, 1.0)) for i, place in enumerate(places))
    thrust = 0.25 * thrust_of_weight * GRAVITY * BALL.body.mass
    robot = replace(
        BALL,
        body=replace(BALL.body, **{"center_of_mass": (0.0, 0.0, 0.0), **body}),
        actuators=Lifters("fans", thrust, fans, Response()),
        performance=replace(BALL.performance, torque=COUPLE * 2.0 * thrust),
    )
    robot.__dict__["kind"] = replace(FREE_FLYER, weighs=True, axes=(2, 3, 4, 5), tilt_deg=0.0)
    return robot


def flown(backend, robot, episode, command, steps=10):
    """Motion after some steps of a command, from rest, level, 2 m above the origin."""
    simulated = backend(robot) if backend is MockBackend else backend(robot, sensor_noise=False)
    simulated.reset(episode(robot, start=LEVEL, com=robot.body.com), seed=0)
    for _ in range(steps):
        sample = simulated.step(np.asarray(command, dtype=float), 2)
    return sample.truth


@BACKENDS
def test_what_nothing_carries_falls(backend, episode):
    robot = lifted()
    seconds = 20 * robot.timing.physics_dt
    fallen = 2.0 - flown(backend, robot, episode, np.zeros(4)).position_in_world[2]
    assert fallen == pytest.approx(0.5 * GRAVITY * seconds**2, rel=1e-3)


@BACKENDS
@pytest.mark.parametrize("com", [(0.0, 0.0, 0.0), (0.01, -0.02, 0.005)])
def test_the_hover_command_holds_a_body_wherever_its_centre_of_mass_is(backend, com, episode):
    robot = lifted(center_of_mass=com)
    state = flown(backend, robot, episode, hover_command(robot))
    np.testing.assert_allclose(state.position_in_world, (0.0, 0.0, 2.0), atol=2e-4)
    np.testing.assert_allclose(state.angular_velocity_in_body, 0.0, atol=1e-3)


def test_a_couple_turns_a_body_in_mujoco_as_in_the_core(episode):
    robot = lifted()
    spun = [flown(each, robot, episode, (0.6, 0.4, 0.6, 0.4)) for each in (MockBackend, MujocoBackend)]
    ours, theirs = (state.angular_velocity_in_body for state in spun)
    seconds = 20 * robot.timing.physics_dt
    expected = COUPLE * 0.4 * robot.actuators.thrust / robot.body.inertia[2] * seconds
    np.testing.assert_allclose(ours, (0.0, 0.0, expected), atol=1e-6, rtol=1e-3)
    np.testing.assert_allclose(theirs, ours, atol=1e-3)


def test_a_check_of_what_is_carried_is_about_its_hover():
    robot = lifted(3.0)
    wrenches = wrench_set_of(robot)
    weight = robot.body.mass * GRAVITY
    np.testing.assert_allclose(wrenches.limits[0], (-weight, 2.0 * weight), rtol=1e-6)
    found = CHECKS["a kind without a row"](robot)
    assert list(found.problems()) == []
    assert found.controllable


def test_actuators_that_do_not_carry_their_body_are_refused():
    with pytest.raises(
        ConfigError, match=r"the fans of 'int_ball2' do not carry its 31\.5 N, level and with"
    ):
        wrench_set_of(lifted(0.9))


# Those that follow a path or stay before a port are for bodies that turn every way.
@pytest.mark.parametrize(
    "name", [name for name in IN_SPACE if name not in ("follow_pose_3d", "inspect", "dock")]
)
def test_what_cannot_hold_a_tilt_begins_level_and_is_sent_to_level_attitudes(name):
    task = load_task(name)
    start, goal = task.draw(Draws(2, np.arange(20), np.zeros(20, dtype=int)), lifted(), training=True)
    places = () if task.goal_topic == "goal_velocity" else (SpatialState.resting(goal.targets),)
    for state in (start, *places):
        x, y, z, _ = state.quat
        np.testing.assert_allclose((x, y), 0.0, atol=1e-12)
        assert np.ptp(z) > 0.5
