"""Basilisk as a backend: what it is asked, what is read from it, and that it moves robots as the core does."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError, SafetyError
from fulmar_core.robots.basilisk_robots import check_basilisk
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.disturbances import Disturbance
from fulmar_core.simulation.disturbed import CanPush, disturbed
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.worlds.scenario import load_scenario
from sim_nodes import basilisk_backend
from sim_nodes.basilisk_backend import BasiliskBackend
from sim_nodes.mock_backend import MockBackend
from tests.basilisk import StandIn, with_basilisk
from tests.new_robots import new_robot
from tests.spaces import task_for

SPACECRAFT, SATELLITE = load_robot("spacecraft_16"), load_robot("cubesat_wheels")
ROBOTS = {
    robot.name: robot
    for robot in (SPACECRAFT, SATELLITE, load_robot("cubesat_8"), load_robot("int_ball2"), new_robot("lopsided_probe"))
}  # fmt: skip
MUST = {"spacecraft_16": 5e-3, "cubesat_wheels": 0.0}  # distance after a minute [m]


@pytest.fixture
def quick(monkeypatch):
    """Builds backends whose Basilisk is the stand-in."""
    monkeypatch.setattr(basilisk_backend, "BasiliskCraft", StandIn)
    monkeypatch.setattr(basilisk_backend, "check_basilisk", lambda robot: None)
    return lambda robot: BasiliskBackend(robot, sensor_noise=False)


def episode_of(robot, scenario, number=0):
    drawn = load_scenario(scenario) if isinstance(scenario, str) else scenario
    return draw_episode(robot, task_for(robot, "go_to_pose"), drawn, seed=7, number=number)


def commands_of(robot, seconds, seed=1):
    """Commands that change in every control step, and are nothing in half of them."""
    rng, scale = np.random.default_rng(seed), robot.actuators.scale
    count = round(seconds / robot.timing.control_s)
    drawn = scale * rng.uniform(-1.0, 1.0, (count, len(scale))) * (rng.random((count, 1)) < 0.5)
    return [robot.actuators.limited(command) for command in drawn]


def path_of(backend, episode, commands):
    """Columns of the true states after each control step, shape (steps, 13); the backend is closed."""
    robot = backend.robot
    ticks, states = robot.timing.substeps(robot.timing.control_hz), []
    backend.reset(episode, seed=7)
    for command in commands:
        truth = backend.step(command, ticks).truth
        states.append(np.concatenate([truth.position_in_world, truth.quat_xyzw, truth.velocity_in_world,
                                      truth.angular_velocity_in_body]))  # fmt: skip
    backend.close()
    return np.array(states)


def distances(one, other):
    """Largest distance [m], and largest difference of a turn rate [rad/s]."""
    apart = np.linalg.norm(one[:, :3] - other[:, :3], axis=1).max()
    return apart, np.abs(one[:, 10:] - other[:, 10:]).max()


SCENARIOS = ("ideal", "randomised", "two_dead", "valve_stuck_open")
PAIRS = [
    (name, scenario)
    for name in ROBOTS
    for scenario in SCENARIOS
    if name != "cubesat_wheels" or scenario != "valve_stuck_open"
]


@pytest.mark.parametrize(("name", "scenario"), PAIRS)
def test_what_basilisk_is_asked_moves_a_robot_as_the_core_does(quick, name, scenario):
    robot = ROBOTS[name]
    episode, commands = episode_of(robot, scenario), commands_of(robot, 4.0)
    ours = path_of(MockBackend(robot), episode, commands)
    theirs = path_of(quick(robot), episode, commands)
    apart, turned = distances(ours, theirs)
    assert np.ptp(ours[:, 10:], axis=0).max() > 1e-3  # it was driven
    assert apart < 1e-3
    assert turned < 1e-7


@pytest.mark.parametrize("scenario", ["low_orbit", "morphologies", "tank_low"])
def test_orbits_other_bodies_and_tanks_reach_basilisk(quick, scenario):
    robot = SATELLITE if scenario == "low_orbit" else ROBOTS["cubesat_8"]
    episode, commands = episode_of(robot, scenario), commands_of(robot, 6.0)
    ours = path_of(MockBackend(robot), episode, commands)
    backend = quick(robot)
    apart, turned = distances(ours, path_of(backend, episode, commands))
    assert apart < 1e-3
    assert turned < 1e-7
    if scenario == "tank_low":
        masses = [move["mass"] for asked in backend._craft.requests[1:] for move in asked["moves"]]
        assert masses[-1] < masses[0] < float(episode.world.mass)


def test_ticks_in_which_nothing_changes_are_asked_for_at_once(quick):
    backend = quick(SPACECRAFT)
    backend.reset(episode_of(SPACECRAFT, "ideal"), seed=1)
    backend.step(np.eye(16)[3], 5)
    (move,) = backend._craft.requests[-1]["moves"]
    assert move["steps"] * 1e-9 * backend._craft.requests[0]["begin"]["step_ns"] == pytest.approx(0.2)
    assert move["drive"][3] == pytest.approx(1.0)


def test_a_thruster_pushes_at_its_place_with_the_centre_of_mass_as_origin(quick):
    robot = ROBOTS["lopsided_probe"]
    backend = quick(robot)
    episode = episode_of(robot, "ideal")
    backend.reset(episode, seed=1)
    com = np.asarray(episode.world.com)
    assert np.abs(com).max() > 1e-3
    for thruster, push in zip(
        backend._craft.requests[0]["begin"]["thrusters"], robot.actuators.pushes, strict=True
    ):
        np.testing.assert_allclose(thruster["direction"], push.direction, atol=1e-12)
        arm = np.array(push.position) - com - np.array(thruster["place"])
        np.testing.assert_allclose(np.cross(arm, push.direction), 0.0, atol=1e-12)  # on the same line


def test_an_accelerometer_measures_the_push_over_the_mass(quick):
    backend = quick(SPACECRAFT)
    episode = episode_of(SPACECRAFT, "ideal")
    backend.reset(episode, seed=1)
    sample = backend.step(np.eye(16)[3], 1)
    np.testing.assert_allclose(sample.imu.specific_force, [0.0, 0.0, 1.0 / SPACECRAFT.body.mass], atol=0.05)


def test_a_person_may_push_it_and_let_go(quick):
    backend = disturbed(quick(SPACECRAFT))
    assert isinstance(quick(SPACECRAFT), CanPush)
    begun = backend.reset(episode_of(SPACECRAFT, "ideal"), seed=1).truth.velocity_in_world
    backend.disturb(Disturbance("push", force=(1.0, 0.0, 0.0), seconds=1.0))
    for _ in range(50):
        truth = backend.step(np.zeros(16), 5).truth
    np.testing.assert_allclose(
        truth.velocity_in_world - begun, [1.0 / SPACECRAFT.body.mass, 0.0, 0.0], atol=1e-9
    )


def test_a_state_that_is_lost_stops_the_run(quick):
    backend = quick(SPACECRAFT)
    backend.reset(episode_of(SPACECRAFT, "ideal"), seed=1)
    backend._craft._mass = np.nan
    with pytest.raises(SafetyError, match=r"Basilisk's state is not finite at t = 0\.20 s"):
        backend.step(np.eye(16)[3], 5)


@pytest.mark.parametrize("name", ["kingfisher", "floating_platform", "airship_v7"])
def test_a_robot_that_does_not_float_in_space_is_refused(name):
    words = f"Basilisk simulates spacecraft and satellites only, and '{name}' is none. MuJoCo simulates it."
    with pytest.raises(ConfigError, match=words):
        check_basilisk(load_robot(name))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "scenario"),
    [
        ("spacecraft_16", "valve_stuck_closed"),
        *((name, each) for name in MUST for each in ("ideal", "randomised")),
    ],
)
def test_basilisk_moves_a_robot_as_the_core_does_for_a_minute(name, scenario):
    robot = ROBOTS[name]
    episode, commands = episode_of(robot, scenario), commands_of(robot, 60.0)
    ours = path_of(MockBackend(robot), episode, commands)
    theirs = path_of(with_basilisk(robot, sensor_noise=False), episode, commands)
    apart, turned = distances(ours, theirs)
    assert np.ptp(ours[:, 10:], axis=0).max() > 0.01  # it was driven
    assert apart <= MUST[name]
    assert turned < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "scenario"), [*PAIRS, ("cubesat_8", "morphologies"), ("cubesat_8", "tank_low")]
)
def test_basilisk_answers_as_the_stand_in(quick, monkeypatch, name, scenario):
    robot = ROBOTS[name]
    episode, commands = episode_of(robot, scenario, number=1), commands_of(robot, 8.0)
    stand_in = path_of(quick(robot), episode, commands)
    monkeypatch.undo()
    basilisk = path_of(with_basilisk(robot, sensor_noise=False), episode, commands)
    apart, turned = distances(stand_in, basilisk)
    assert apart < 1e-4
    assert turned < 1e-8


@pytest.mark.slow
def test_accelerometers_agree_with_the_stand_in(quick, monkeypatch):
    def felt(backend):
        backend.reset(episode_of(SPACECRAFT, "uncertain", number=2), seed=1)
        return np.array([backend.step(np.eye(16)[i % 16], 5) and backend._felt() for i in range(20)])

    ours = felt(quick(SPACECRAFT))
    monkeypatch.undo()
    np.testing.assert_allclose(felt(with_basilisk(SPACECRAFT)), ours, atol=2e-3)
