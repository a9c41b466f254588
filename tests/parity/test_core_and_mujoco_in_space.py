"""Bodies in space in the core and in MuJoCo: two implementations, one motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.attitude import angle_between, turn_back
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from sim_nodes.mock_backend import MockBackend
from tests.new_robots import new_robot

mujoco = pytest.importorskip("mujoco")

from sim_nodes.mujoco_backend import MujocoBackend  # noqa: E402

SPACECRAFT, BALL, PROBE = load_robot("spacecraft_16"), load_robot("int_ball2"), new_robot("lopsided_probe")
ROBOTS = pytest.mark.parametrize("robot", [SPACECRAFT, BALL, PROBE], ids=lambda robot: robot.name)
POSE = load_task("go_to_pose_3d")
SECONDS = 20.0


def changing_commands(robot, steps):
    """Some actuators on at a time, others from second to second, shape (steps, n)."""
    rng = np.random.default_rng(0)
    each = rng.uniform(size=(steps // 5 + 1, len(robot.actuators.names))) > 0.6
    return robot.actuators.limited(np.repeat(each, 5, axis=0)[:steps].astype(float))


def flown(backend, episode, commands):
    """The true states after each command."""
    backend.reset(episode, seed=0)
    substeps = backend.robot.timing.substeps(backend.robot.timing.control_hz)
    return [SpatialState.from_rigid(backend.step(command, substeps).truth) for command in commands]


def parts(states):
    """Positions, velocities and turn rates, each of shape (steps, 3)."""
    return [np.array([getattr(state, name) for state in states]) for name in ("position", "velocity", "rate")]


@ROBOTS
@pytest.mark.parametrize("scenario", ["ideal", "randomised"])
def test_a_body_in_space_flies_alike_for_twenty_seconds(robot, scenario):
    episode = draw_episode(robot, POSE, load_scenario(scenario), seed=3, number=1)
    commands = changing_commands(robot, round(SECONDS * robot.timing.control_hz))
    ours = flown(MockBackend(robot), episode, commands)
    theirs = flown(MujocoBackend(robot, sensor_noise=False), episode, commands)
    (position, velocity, rate), (place, speed, turn) = parts(ours), parts(theirs)
    # Both are of fourth order in the rotation. The core's path is of second order in the step for forces that turn with
    # the body: 1e-4 m over some metres with the spacecraft's step of 0.04 s.
    np.testing.assert_allclose(turn, rate, rtol=0, atol=1e-9)
    assert max(angle_between(a.quat, b.quat) for a, b in zip(ours, theirs, strict=True)) < 1e-6
    np.testing.assert_allclose(place, position, rtol=0, atol=2e-4)
    np.testing.assert_allclose(speed, velocity, rtol=0, atol=5e-5)
    assert np.linalg.norm(position[-1] - position[0]) > 1.0  # it did move
    assert np.linalg.norm(rate[-1]) > 0.3  # and turn


@pytest.mark.parametrize("part", ["inertia", "center_of_mass"])
def test_products_of_inertia_and_an_offset_centre_of_mass_count_in_both(part):
    """What the test above compares is not left out by both."""
    plain = (0.0,) * 3 if part == "center_of_mass" else PROBE.body.inertia[:3]
    other = replace(PROBE, body=replace(PROBE.body, **{part: plain}))
    for simulator in (MockBackend, MujocoBackend):
        rates = []
        for robot in (PROBE, other):
            episode = draw_episode(robot, POSE, load_scenario("ideal"), seed=3, number=1)
            rates.append(flown(simulator(robot), episode, changing_commands(robot, 50))[-1].rate)
        assert np.linalg.norm(np.subtract(*rates)) > 0.05


@ROBOTS
def test_the_batch_flies_as_one_body_does(robot):
    scenario = load_scenario("ideal")
    simulation = BatchSimulation(robot, POSE, scenario, worlds=3, seed=3)
    commands = changing_commands(robot, 50)
    for command in commands:
        simulation.step(np.tile(command, (3, 1)))
    alone = flown(MockBackend(robot), draw_episode(robot, POSE, scenario, seed=3, number=1), commands)[-1]
    # The batch is float32: rounding, grown over 10 s.
    np.testing.assert_allclose(np.array(simulation.truth.position)[:, 1], alone.position, rtol=0, atol=2e-3)
    np.testing.assert_allclose(np.array(simulation.truth.rate)[:, 1], alone.rate, rtol=0, atol=2e-4)


ORBIT = replace(
    load_scenario("ideal"), orbit_rate=0.05
)  # forty times that of a low one: it shows within seconds


def tipped(robot, scenario):
    """An episode that begins at rest, aside of every equilibrium."""
    episode = draw_episode(robot, POSE, scenario, seed=3, number=1)
    pose = SpatialState.target_at((0.0, 0.0, 0.0, 25.0, 35.0, 10.0))
    return replace(episode, start=SpatialState.resting(pose))


@pytest.mark.parametrize("robot", [BALL, PROBE], ids=lambda robot: robot.name)
def test_the_gravity_gradient_of_an_orbit_turns_a_body_alike(robot):
    episode, still = tipped(robot, ORBIT), np.zeros((100, len(robot.actuators.names)))
    ours, theirs = (
        flown(simulator, episode, still)
        for simulator in (MockBackend(robot), MujocoBackend(robot, sensor_noise=False))
    )
    rate, turn = parts(ours)[2], parts(theirs)[2]
    np.testing.assert_allclose(turn, rate, rtol=0, atol=1e-9)
    assert max(angle_between(a.quat, b.quat) for a, b in zip(ours, theirs, strict=True)) < 1e-6
    without = flown(MockBackend(robot), tipped(robot, load_scenario("ideal")), still)
    assert not np.any(parts(without)[2])  # off by default
    # Euler's equation at rest, over the first step: ω̇ = J⁻¹ · 3 n² u × J u, with u the way from the planet in the body,
    # which has turned about the world's y in the middle of the step.
    inertia, start = robot.body.inertia_matrix, episode.start
    angle = 0.05 * 0.5 * robot.timing.control_s
    up = np.array(turn_back(start.quat, (np.sin(angle), 0.0, np.cos(angle))))
    expected = np.linalg.solve(inertia, 3.0 * 0.05**2 * np.cross(up, inertia @ up)) * robot.timing.control_s
    np.testing.assert_allclose(rate[0], expected, rtol=1e-3, atol=1e-12)
    assert np.linalg.norm(rate[-1]) > 20.0 * np.linalg.norm(rate[0])


def test_a_sphere_does_not_feel_the_gravity_gradient():
    still = np.zeros((20, 16))
    assert np.abs(parts(flown(MockBackend(SPACECRAFT), tipped(SPACECRAFT, ORBIT), still))[2]).max() < 1e-15


@pytest.mark.parametrize("robot", [BALL, PROBE], ids=lambda robot: robot.name)
def test_the_batch_turns_in_orbit_as_one_body_does(robot):
    simulation = BatchSimulation(robot, POSE, ORBIT, worlds=2, seed=3, dtype=np.float64)
    still = np.zeros((25, len(robot.actuators.names)))
    for command in still:
        simulation.step(np.tile(command, (2, 1)))
    alone = flown(MockBackend(robot), draw_episode(robot, POSE, ORBIT, seed=3, number=1), still)[-1]
    np.testing.assert_allclose(np.array(simulation.truth.rate)[:, 1], alone.rate, rtol=0, atol=1e-12)
    calm = draw_episode(robot, POSE, load_scenario("ideal"), seed=3, number=1)
    assert np.linalg.norm(np.subtract(flown(MockBackend(robot), calm, still)[-1].rate, alone.rate)) > 1e-4
