"""What every simulated backend promises, whoever integrates the bodies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_bringup.system import SIMULATED
from fulmar_core.disturbances.scenario import World
from fulmar_core.robot import load_robot
from fulmar_core.state import planar_state
from sim_nodes.mock_backend import MockBackend

ROBOT = load_robot("floating_platform")
STILL = World(ROBOT.body.mass, ROBOT.body.inertia, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
START = planar_state(1.0, -2.0, 0.5, vx=0.1, yaw_rate=0.1)
COMMAND = np.array([1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0])


def build_mujoco(robot):
    pytest.importorskip("mujoco")
    from sim_nodes.mujoco_backend import MujocoBackend

    return MujocoBackend(robot)


BUILDERS = {"mock": MockBackend, "mujoco": build_mujoco}


@pytest.fixture(params=sorted(BUILDERS))
def backend(request):
    backend = BUILDERS[request.param](ROBOT)
    yield backend
    backend.close()


def test_every_simulated_backend_is_under_this_contract():
    assert set(BUILDERS) == set(SIMULATED)


def test_it_speaks_for_its_robot(backend):
    assert backend.robot is ROBOT


def test_a_reset_begins_where_it_was_told(backend):
    truth = backend.reset(START, STILL, seed=1).truth
    for name in ("position_in_world", "quat_xyzw", "velocity_in_world", "angular_velocity_in_body"):
        np.testing.assert_allclose(getattr(truth, name), getattr(START, name), rtol=0, atol=1e-12)


def test_samples_have_no_batch_axis_and_hold_float64(backend):
    backend.reset(START, STILL, seed=1)
    for state in (backend.step(COMMAND).odometry, backend.step(COMMAND).truth):
        shapes = [state.position_in_world.shape, state.quat_xyzw.shape, state.velocity_in_world.shape]
        assert shapes == [(3,), (4,), (3,)]
        assert state.angular_velocity_in_body.shape == (3,)
        assert state.position_in_world.dtype == np.float64


def test_odometry_is_near_the_truth(backend):
    backend.reset(START, STILL, seed=1)
    sample = backend.step(COMMAND, 10)
    spec = ROBOT.sensors.odometry
    error = sample.odometry.position_in_world - sample.truth.position_in_world
    assert np.abs(error).max() <= 6 * max(spec.position_std)
    turn = sample.odometry.angular_velocity_in_body - sample.truth.angular_velocity_in_body
    assert np.abs(turn).max() <= 6 * max(spec.angular_velocity_std)


def test_ten_ticks_are_ten_times_one_tick(backend):
    backend.reset(START, STILL, seed=1)
    at_once = backend.step(COMMAND, 10).truth
    backend.reset(START, STILL, seed=1)
    for _ in range(10):
        one_by_one = backend.step(COMMAND).truth
    np.testing.assert_allclose(at_once.position_in_world, one_by_one.position_in_world, rtol=0, atol=1e-12)
    np.testing.assert_allclose(at_once.quat_xyzw, one_by_one.quat_xyzw, rtol=0, atol=1e-12)


def test_the_same_seed_gives_the_same_samples_and_a_reset_forgets_everything(backend):
    def story():
        samples = [backend.reset(START, STILL, seed=4), *(backend.step(COMMAND, 3) for _ in range(5))]
        return np.array([sample.odometry.position_in_world for sample in samples])

    first = story()
    backend.reset(
        planar_state(9.0, 9.0, 3.0), World(1.0, (1.0, 1.0, 1.0), (1.0, 1.0, 0.0), (0.0, 0.0, 1.0)), seed=5
    )
    backend.step(COMMAND, 7)
    np.testing.assert_array_equal(first, story())


def test_a_kept_sample_does_not_change_with_later_steps(backend):
    kept = backend.reset(START, STILL, seed=1)
    before = kept.truth.position_in_world.copy(), kept.odometry.position_in_world.copy()
    backend.step(COMMAND, 50)
    np.testing.assert_array_equal(kept.truth.position_in_world, before[0])
    np.testing.assert_array_equal(kept.odometry.position_in_world, before[1])


def test_without_thrust_a_platform_glides_on(backend):
    backend.reset(planar_state(0.0, 0.0, 0.0, vx=0.1, vy=-0.2), STILL, seed=1)
    truth = backend.step(np.zeros(8), 50).truth  # one second
    np.testing.assert_allclose(truth.position_in_world, [0.1, -0.2, 0.0], rtol=0, atol=1e-9)


def test_it_obeys_the_mass_and_the_wrench_of_its_world(backend):
    heavy = World(10.0, (0.2, 0.2, 0.25), (0.5, 0.0, 0.0), (0.0, 0.0, 0.05))
    backend.reset(planar_state(0.0, 0.0, 1.0), heavy, seed=1)
    truth = backend.step(np.zeros(8), 50).truth
    np.testing.assert_allclose(truth.velocity_in_world, [0.05, 0.0, 0.0], rtol=0, atol=1e-9)
    assert truth.angular_velocity_in_body[2] == pytest.approx(0.2, abs=1e-9)


def test_a_planar_robot_stays_in_its_plane(backend):
    tilting = replace(STILL, force_in_world=(0.1, 0.0, 5.0), torque_in_world=(0.5, 0.5, 0.0))
    backend.reset(START, tilting, seed=1)
    truth = backend.step(COMMAND, 50).truth
    np.testing.assert_allclose([truth.position_in_world[2], truth.velocity_in_world[2]], 0.0, atol=1e-12)
    np.testing.assert_allclose([*truth.quat_xyzw[:2], *truth.angular_velocity_in_body[:2]], 0.0, atol=1e-12)


def test_closing_twice_does_no_harm(backend):
    backend.close()
    backend.close()
