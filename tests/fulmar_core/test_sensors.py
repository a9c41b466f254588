"""What odometry and inertial unit make of the truth."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from fulmar_core.robot import load_robot
from fulmar_core.rotation import multiply
from fulmar_core.sensors.imu import ImuSample, ImuSpec, measure_imu
from fulmar_core.sensors.odometry import measure_odometry
from fulmar_core.state import planar_state

ODOMETRY = load_robot("floating_platform").sensors.odometry
SILENT = replace(
    ODOMETRY, **{f"{n}_std": (0.0,) * 3 for n in ("position", "rotation", "velocity", "angular_velocity")}
)
CONJUGATE = np.array([-1.0, -1.0, -1.0, 1.0])
WORLDS = 20_000  # the sample deviation is then within 0.5 % of the true one (one sigma); we allow 3 %


def crowd():
    zeros = np.zeros(WORLDS)
    return planar_state(zeros, zeros, zeros + 1.0, vx=zeros + 0.2, yaw_rate=zeros + 0.1)


def test_without_noise_the_odometry_is_the_truth():
    truth = crowd()
    measured = measure_odometry(truth, SILENT, np.random.default_rng(0))
    np.testing.assert_array_equal(measured.position_in_world, truth.position_in_world)
    np.testing.assert_allclose(measured.quat_xyzw, truth.quat_xyzw, rtol=0, atol=1e-15)
    np.testing.assert_array_equal(measured.velocity_in_world, truth.velocity_in_world)
    np.testing.assert_array_equal(measured.angular_velocity_in_body, truth.angular_velocity_in_body)


@pytest.mark.parametrize("part", ["position", "velocity", "angular_velocity", "rotation"])
def test_the_noise_has_no_bias_and_the_deviation_of_the_yaml(part):
    spec = replace(SILENT, **{f"{part}_std": (0.01, 0.02, 0.03)})
    truth = crowd()
    measured = measure_odometry(truth, spec, np.random.default_rng(1))
    name = {"position": "position_in_world", "velocity": "velocity_in_world"}.get(
        part, "angular_velocity_in_body"
    )
    if part == "rotation":  # twice the vector part is the rotation vector, to 1e-5 for angles this small
        error = 2.0 * multiply(truth.quat_xyzw * CONJUGATE, measured.quat_xyzw)[:, :3]
    else:
        error = getattr(measured, name) - getattr(truth, name)
    np.testing.assert_allclose(error.std(axis=0), [0.01, 0.02, 0.03], rtol=0.03)
    np.testing.assert_allclose(error.mean(axis=0), 0.0, atol=4 * 0.03 / np.sqrt(WORLDS))


def test_the_platform_s_odometry_leaves_the_plane_untouched():
    measured = measure_odometry(crowd(), ODOMETRY, np.random.default_rng(2))
    assert not measured.position_in_world[:, 2].any()
    assert not measured.quat_xyzw[:, :2].any()


def test_measured_quaternions_have_length_one():
    measured = measure_odometry(crowd(), ODOMETRY, np.random.default_rng(3))
    np.testing.assert_allclose(np.linalg.norm(measured.quat_xyzw, axis=1), 1.0, rtol=0, atol=1e-9)


def test_the_same_generator_gives_the_same_noise_and_the_type_is_kept():
    truth = crowd().astype(np.float32)
    first, second = (measure_odometry(truth, ODOMETRY, np.random.default_rng(4)) for _ in range(2))
    np.testing.assert_array_equal(first.position_in_world, second.position_in_world)
    assert first.position_in_world.dtype == np.float32
    assert not np.array_equal(first.position_in_world, truth.position_in_world)


def test_the_inertial_unit_adds_its_two_noises_to_the_truth():
    truth = ImuSample(np.array([0.0, 0.0, 9.81]), np.array([0.0, 0.0, 0.1]))
    rng = np.random.default_rng(5)
    samples = [measure_imu(truth, ImuSpec(0.02, 0.003), rng) for _ in range(4000)]
    force = np.array([s.specific_force for s in samples]) - truth.specific_force
    turn = np.array([s.angular_velocity for s in samples]) - truth.angular_velocity
    assert force.std() == pytest.approx(0.02, rel=0.03)  # 12,000 numbers: one sigma is 0.65 %
    assert turn.std() == pytest.approx(0.003, rel=0.03)
    assert abs(np.corrcoef(force[:, 0], turn[:, 0])[0, 1]) < 0.06  # four sigma of independent noises


def test_an_inertial_unit_without_noise_tells_the_truth():
    truth = ImuSample(np.array([1.0, 2.0, 3.0]), np.array([4.0, 5.0, 6.0]))
    measured = measure_imu(truth, ImuSpec(0.0, 0.0), np.random.default_rng(6))
    assert measured.specific_force.tolist() == [1.0, 2.0, 3.0]
    assert measured.angular_velocity.tolist() == [4.0, 5.0, 6.0]


def test_the_odometry_has_no_rate_of_its_own_that_changes_nothing():
    assert "rate_hz" not in {field.name for field in fields(ODOMETRY)}
