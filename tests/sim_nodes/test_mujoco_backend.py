"""MuJoCo begins at the given start, and its sensors have the noise of the YAML."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import SafetyError
from fulmar_core.config.paths import config_names
from fulmar_core.robots.actuators.rolling import Rolling
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.star_tracker import StarTrackerSpec
from fulmar_core.states.gravity import GRAVITY
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.spatial import SpatialState

mujoco = pytest.importorskip("mujoco")

from sim_nodes.mujoco_backend import MujocoBackend  # noqa: E402

ROBOT = load_robot("floating_platform")
EVERY = config_names("robots")
CLOSED = np.zeros(8)
OTHER_WORLD = {
    PlanarState: {"force_x": 1.0, "torque": 0.1, "com_x": 0.01, "drag": 1.1},
    SpatialState: {"force": (1.0, 0.0, 0.0), "torque": (0.0, 0.0, 0.1), "com": (0.01, 0.0, 0.0)},
}


@pytest.fixture
def quiet():
    return MujocoBackend(ROBOT, sensor_noise=False)


def moving(robot):
    """A start that moves as the robot can: on wheels, along its heading; in space, every way."""
    if robot.state_type is SpatialState:
        return 1.0, -2.0, 0.5, 0.5, -0.1, 0.5, 0.7, 0.2, 0.1, -0.1, 0.3, -0.2, 0.1
    ahead, left = (0.2, 0.0) if isinstance(robot.actuators, Rolling) else (0.2, 0.1)
    turn = 0.0 if robot.actuators.kind == "ackermann" else 0.3
    yaw = 0.7
    vx, vy = np.cos(yaw) * ahead - np.sin(yaw) * left, np.sin(yaw) * ahead + np.cos(yaw) * left
    return 1.0, -2.0, yaw, vx, vy, turn


@pytest.mark.parametrize("name", EVERY)
def test_what_mujoco_makes_of_masses_is_made_of_those_of_the_episode(name, episode):
    robot = load_robot(name)
    backend = MujocoBackend(robot)
    heavier = 1.1 * robot.body.mass
    backend.reset(episode(robot, mass=heavier), seed=0)
    model = backend.model
    assert model.body_subtreemass[0] == pytest.approx(model.body_mass.sum()) == pytest.approx(heavier)


@pytest.mark.parametrize("name", EVERY)
def test_a_reset_puts_every_robot_where_it_was_asked_to_be(name, episode):
    robot = load_robot(name)
    start = moving(robot)
    sample = MujocoBackend(robot, sensor_noise=False).reset(episode(robot, start=start), seed=0)
    for part in (sample.truth, sample.odometry):
        state = robot.state_type.from_rigid(part)
        np.testing.assert_allclose(state.columns(), start, rtol=0, atol=1e-6)
        if robot.state_type is SpatialState:
            continue
        assert part.position_in_world[2] == pytest.approx(0.0, abs=1e-9)
        np.testing.assert_allclose(
            part.quat_xyzw[:2], 0.0, atol=2e-3
        )  # a chassis leans a little on its casters


@pytest.mark.parametrize("name", EVERY)
def test_nothing_jumps_after_a_reset(name, episode):
    robot = load_robot(name)
    backend = MujocoBackend(robot, sensor_noise=False)
    backend.reset(episode(robot), seed=0)
    truth = backend.step(robot.actuators.safe_command, 50).truth
    np.testing.assert_allclose(truth.position_in_world, 0.0, atol=1e-4)
    np.testing.assert_allclose(truth.velocity_in_world, 0.0, atol=1e-3)
    np.testing.assert_allclose(truth.angular_velocity_in_body, 0.0, atol=1e-3)


@pytest.mark.parametrize("name", [name for name in EVERY if not load_robot(name).flies])
def test_at_rest_the_inertial_unit_reads_plus_g_and_in_space_nothing(name, episode):
    robot = load_robot(name)
    backend = MujocoBackend(robot, sensor_noise=False)
    backend.reset(episode(robot, start=(1.0, 2.0, 0.7, 0.0, 0.0, 0.0)), seed=0)
    sample = backend.step(robot.actuators.safe_command, 50)
    # A chassis that leans by a thousandth feels a thousandth of g along its axis.
    weight = 0.0 if robot.state_type is SpatialState else GRAVITY
    np.testing.assert_allclose(sample.imu.specific_force, [0.0, 0.0, weight], rtol=0, atol=0.02)
    np.testing.assert_allclose(sample.imu.angular_velocity, 0.0, atol=1e-3)


def test_under_thrust_the_inertial_unit_reads_the_acceleration(quiet, episode):
    quiet.reset(episode(ROBOT, start=(0.0, 0.0, 0.7, 0.0, 0.0, 0.0)), seed=0)
    command = np.array([1.0, 0, 0, 0, 0, 0, 0, 1.0])  # thrusters 1 and 8: forward, half a newton each
    sample = quiet.step(command)
    np.testing.assert_allclose(
        sample.imu.specific_force, [np.sqrt(0.5) / ROBOT.body.mass, 0.0, GRAVITY], rtol=0, atol=1e-6
    )


def test_a_reset_takes_the_mass_inertia_and_wrench_of_the_world(quiet, episode):
    quiet.reset(episode(ROBOT, mass=2.0, yaw_inertia=0.1, force_x=1.0, torque=0.05), seed=0)
    truth = quiet.step(CLOSED).truth
    np.testing.assert_allclose(truth.velocity_in_world, [1.0 / 2.0 * 0.02, 0.0, 0.0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(
        truth.angular_velocity_in_body, [0.0, 0.0, 0.05 / 0.1 * 0.02], rtol=0, atol=1e-12
    )


@pytest.mark.parametrize("name", EVERY)
def test_a_reset_forgets_the_command_and_the_world_of_before(name, episode):
    robot = load_robot(name)
    backend = MujocoBackend(robot, sensor_noise=False)

    def story():
        backend.reset(episode(robot), seed=0)
        return backend.step(0.5 * robot.actuators.scale, 10).truth.position_in_world

    first = story()
    backend.reset(episode(robot, mass=1.1 * robot.body.mass, **OTHER_WORLD[robot.state_type]), seed=0)
    backend.step(-0.5 * robot.actuators.scale, 30)
    np.testing.assert_array_equal(story(), first)


def noisy_run(episode, seed, number=0, backend=None):
    backend = backend or MujocoBackend(ROBOT)
    samples = [backend.reset(episode(ROBOT, noise=1.0), seed=seed, number=number)]
    samples += [backend.step(CLOSED) for _ in range(20)]
    return np.array([[*s.odometry.position_in_world[:2], *s.imu.specific_force] for s in samples])


def test_two_resets_with_one_seed_give_the_same_samples(episode):
    backend = MujocoBackend(ROBOT)
    first = noisy_run(episode, 4, backend=backend)
    np.testing.assert_array_equal(first, noisy_run(episode, 4, backend=backend))
    np.testing.assert_array_equal(first, noisy_run(episode, 4))


def test_a_star_tracker_changes_no_bit_of_the_other_sensors(episode):
    stars = StarTrackerSpec(std=1e-3, bias_std=1e-3, rate_hz=5.0, dropout=0.3)
    starry = MujocoBackend(replace(ROBOT, sensors=replace(ROBOT.sensors, star_tracker=stars)))
    np.testing.assert_array_equal(noisy_run(episode, 4, backend=starry), noisy_run(episode, 4))
    starry.reset(episode(ROBOT), seed=4)
    assert any("star_tracker" in starry.step(CLOSED).readings for _ in range(20))


def test_another_seed_or_episode_gives_other_noise_everywhere(episode):
    first = noisy_run(episode, 4)
    assert (first != noisy_run(episode, 5)).all()
    assert (first != noisy_run(episode, 4, number=1)).all()


def test_noise_is_in_the_measurement_and_never_in_the_truth(episode):
    backend = MujocoBackend(ROBOT)
    sample = backend.reset(episode(ROBOT, start=(1.0, 2.0, 0.0, 0.0, 0.0, 0.0), noise=1.0), seed=1)
    np.testing.assert_allclose(sample.truth.position_in_world, [1.0, 2.0, 0.0], rtol=0, atol=1e-12)
    error = sample.odometry.position_in_world - sample.truth.position_in_world
    assert 0.0 < np.abs(error).max() < 6.0 * ROBOT.sensors.odometry.position.std
    assert np.abs(sample.imu.specific_force[:2]).max() > 0.0


def test_without_noise_measurement_and_truth_are_one(quiet, episode):
    quiet.reset(episode(ROBOT), seed=1)
    sample = quiet.step(np.array([1.0, *[0.0] * 7]), 5)
    np.testing.assert_array_equal(sample.odometry.position_in_world, sample.truth.position_in_world)


def test_odometry_of_a_boat_has_the_true_heave_roll_and_pitch(episode):
    boat = load_robot("kingfisher")
    backend = MujocoBackend(boat)
    backend.reset(episode(boat, noise=1.0), seed=0)
    backend.data.qpos[2], backend.data.qpos[3:7] = 0.03, (np.cos(0.1), np.sin(0.1), 0.0, 0.0)
    sample = backend.step(np.zeros(2))
    assert sample.odometry.position_in_world[2] == sample.truth.position_in_world[2]
    assert sample.odometry.quat_xyzw[0] == pytest.approx(sample.truth.quat_xyzw[0], abs=1e-3)
    assert sample.odometry.yaw != sample.truth.yaw
    assert np.linalg.norm(sample.odometry.quat_xyzw) == pytest.approx(1.0)


def test_a_state_that_is_not_finite_ends_the_simulation_loudly(quiet, episode, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo leaves a log file where it is
    quiet.reset(episode(ROBOT), seed=0)
    quiet.data.qpos[0] = np.nan
    with pytest.raises(SafetyError, match="not finite"):
        quiet.step(CLOSED)
