"""MuJoCo's model has the YAML's numbers, and its sensors tell the truth plus the YAML's noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.disturbances.scenario import World
from fulmar_core.errors import SafetyError
from fulmar_core.robot import load_robot
from fulmar_core.state import planar_state

mujoco = pytest.importorskip("mujoco")

from sim_nodes.mujoco_backend import MujocoBackend  # noqa: E402
from sim_nodes.mujoco_model import BODY, GRAVITY, IMU_SITE, build_model  # noqa: E402

ROBOT = load_robot("floating_platform")
FREE = replace(ROBOT, body=replace(ROBOT.body, planar=False, inertia=(0.1, 0.2, 0.3)))
STILL = World(ROBOT.body.mass, ROBOT.body.inertia, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
CLOSED = np.zeros(8)


@pytest.fixture
def quiet():
    return MujocoBackend(ROBOT, sensor_noise=False)


@pytest.mark.parametrize("robot", [ROBOT, FREE], ids=["planar", "free"])
def test_the_compiled_model_has_mass_and_inertia_of_the_yaml(robot):
    model = build_model(robot)
    body = model.body(BODY)
    assert body.mass[0] == robot.body.mass
    np.testing.assert_array_equal(body.inertia, robot.body.inertia)
    np.testing.assert_array_equal(body.ipos, 0.0)
    np.testing.assert_array_equal(body.iquat, [1.0, 0.0, 0.0, 0.0])  # principal axes are the body's own


def test_the_hull_has_the_outline_of_the_yaml_and_touches_nothing():
    hull = build_model(ROBOT).geom("hull")
    np.testing.assert_allclose(hull.size[:2], [ROBOT.body.radius, ROBOT.body.height / 2])
    assert (hull.contype[0], hull.conaffinity[0]) == (0, 0)


def test_the_model_steps_as_the_yaml_says_with_the_integrator_of_the_core():
    model = build_model(ROBOT)
    assert model.opt.timestep == ROBOT.timing.physics_dt
    assert model.opt.integrator == mujoco.mjtIntegrator.mjINT_EULER


def test_each_nozzle_is_a_site_and_an_actuator_in_the_order_of_the_yaml():
    model = build_model(ROBOT)
    assert model.nu == len(ROBOT.actuators.nozzles)
    for i, nozzle in enumerate(ROBOT.actuators.nozzles):
        assert model.actuator(i).name == nozzle.name
        np.testing.assert_allclose(model.site(nozzle.name).pos, nozzle.position, rtol=0, atol=1e-12)
        expected = np.array(nozzle.direction) / np.linalg.norm(nozzle.direction)
        np.testing.assert_allclose(model.actuator_gear[i], [*expected, 0.0, 0.0, 0.0], rtol=0, atol=1e-12)
        assert model.actuator_gainprm[i][0] == 1.0  # a control is a force in newtons


def test_a_planar_robot_has_two_slides_and_a_hinge_and_a_free_one_six_degrees():
    assert (build_model(ROBOT).nv, build_model(FREE).nv) == (3, 6)
    assert build_model(ROBOT).opt.gravity[2] == -GRAVITY
    assert build_model(FREE).opt.gravity[2] == 0.0


def test_the_inertial_unit_sits_at_the_body_s_origin():
    np.testing.assert_array_equal(build_model(ROBOT).site(IMU_SITE).pos, 0.0)


def test_at_rest_the_inertial_unit_reads_plus_g(quiet):
    sample = quiet.reset(planar_state(1.0, 2.0, 0.7), STILL, seed=0)
    np.testing.assert_allclose(sample.imu.specific_force, [0.0, 0.0, GRAVITY], rtol=0, atol=1e-9)
    np.testing.assert_allclose(sample.imu.angular_velocity, 0.0, atol=1e-12)


def test_under_thrust_the_inertial_unit_reads_the_acceleration(quiet):
    quiet.reset(planar_state(0.0, 0.0, 0.7), STILL, seed=0)
    command = np.array([1.0, 0, 0, 0, 0, 0, 0, 1.0])  # thrusters 1 and 8: forward, half a newton each
    sample = quiet.step(command)
    np.testing.assert_allclose(
        sample.imu.specific_force, [np.sqrt(0.5) / ROBOT.body.mass, 0.0, GRAVITY], rtol=0, atol=1e-6
    )


def test_a_reset_puts_the_robot_where_it_was_asked_to_be(quiet):
    start = planar_state(1.0, -2.0, 0.7, vx=0.3, vy=0.1, yaw_rate=-0.4)
    for part in (quiet.reset(start, STILL, seed=0).truth, quiet.reset(start, STILL, seed=0).odometry):
        np.testing.assert_allclose(part.position_in_world, start.position_in_world, rtol=0, atol=1e-12)
        np.testing.assert_allclose(part.quat_xyzw, start.quat_xyzw, rtol=0, atol=1e-12)
        np.testing.assert_allclose(part.velocity_in_world, start.velocity_in_world, rtol=0, atol=1e-12)
        np.testing.assert_allclose(
            part.angular_velocity_in_body, start.angular_velocity_in_body, rtol=0, atol=1e-12
        )


def test_a_reset_takes_the_mass_inertia_and_wrench_of_the_world(quiet):
    world = World(2.0, (0.2, 0.2, 0.1), (1.0, 0.0, 0.0), (0.0, 0.0, 0.05))
    quiet.reset(planar_state(0.0, 0.0, 2.0), world, seed=0)
    truth = quiet.step(CLOSED).truth
    np.testing.assert_allclose(truth.velocity_in_world, [1.0 / 2.0 * 0.02, 0.0, 0.0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(
        truth.angular_velocity_in_body, [0.0, 0.0, 0.05 / 0.1 * 0.02], rtol=0, atol=1e-12
    )


def test_a_reset_forgets_the_command_and_the_wrench_of_before(quiet):
    quiet.reset(planar_state(0.0, 0.0, 0.0), World(1.0, (0.1,) * 3, (5.0, 0.0, 0.0), (0.0, 0.0, 1.0)), seed=0)
    quiet.step(np.array([1.0, *[0.0] * 7]), 10)
    quiet.reset(planar_state(0.0, 0.0, 0.0), STILL, seed=0)
    truth = quiet.step(CLOSED, 10).truth
    np.testing.assert_allclose(truth.velocity_in_world, 0.0, atol=1e-12)
    np.testing.assert_allclose(truth.position_in_world, 0.0, atol=1e-12)


def noisy_run(seed, number=0, backend=None):
    backend = backend or MujocoBackend(ROBOT)
    samples = [backend.reset(planar_state(0.0, 0.0, 0.0), STILL, seed=seed, number=number)]
    samples += [backend.step(CLOSED) for _ in range(20)]
    return np.array([[*s.odometry.position_in_world, *s.imu.specific_force] for s in samples])


def test_two_resets_with_one_seed_give_the_same_samples():
    backend = MujocoBackend(ROBOT)
    np.testing.assert_array_equal(noisy_run(4, backend=backend), noisy_run(4, backend=backend))
    np.testing.assert_array_equal(noisy_run(4), noisy_run(4, backend=backend))


def test_another_seed_or_episode_gives_other_noise():
    assert not np.array_equal(noisy_run(4), noisy_run(5))
    assert not np.array_equal(noisy_run(4), noisy_run(4, number=1))


def test_noise_is_in_the_measurement_and_never_in_the_truth():
    backend = MujocoBackend(ROBOT)
    sample = backend.reset(planar_state(1.0, 2.0, 0.0), STILL, seed=1)
    np.testing.assert_allclose(sample.truth.position_in_world, [1.0, 2.0, 0.0], rtol=0, atol=1e-12)
    error = sample.odometry.position_in_world - sample.truth.position_in_world
    assert 0.0 < np.abs(error).max() < 0.006  # six deviations of 1 mm
    assert np.abs(sample.imu.specific_force[:2]).max() > 0.0


def test_without_noise_measurement_and_truth_are_one(quiet):
    quiet.reset(planar_state(0.0, 0.0, 0.0), STILL, seed=1)
    sample = quiet.step(np.array([1.0, *[0.0] * 7]), 5)
    np.testing.assert_array_equal(sample.odometry.position_in_world, sample.truth.position_in_world)


def test_a_state_that_is_not_finite_ends_the_simulation_loudly(quiet, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo leaves a log file where it is
    quiet.reset(planar_state(0.0, 0.0, 0.0), STILL, seed=0)
    quiet.data.qpos[0] = np.nan
    with pytest.raises(SafetyError, match="not finite"):
        quiet.step(CLOSED)


def test_a_free_robot_can_start_tilted_and_moving():
    start = replace(
        planar_state(0.1, 0.2, 0.0, vx=0.3),
        position_in_world=np.array([0.1, 0.2, 0.3]),
        quat_xyzw=np.array([0.5, -0.5, 0.5, 0.5]),
        angular_velocity_in_body=np.array([0.1, 0.2, 0.3]),
    )
    truth = MujocoBackend(FREE, sensor_noise=False).reset(start, still_world(FREE), seed=0).truth
    np.testing.assert_allclose(truth.position_in_world, start.position_in_world, rtol=0, atol=1e-12)
    np.testing.assert_allclose(truth.quat_xyzw, start.quat_xyzw, rtol=0, atol=1e-12)
    np.testing.assert_allclose(
        truth.angular_velocity_in_body, start.angular_velocity_in_body, rtol=0, atol=1e-12
    )


def still_world(robot):
    return World(robot.body.mass, robot.body.inertia, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
