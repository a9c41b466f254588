"""Attitudes as tuples of arrays, beside SciPy's rotations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fulmar_core.states import attitude
from fulmar_core.states.counter_rng import START, Draws

MANY = 2_000


def backwards(quats):
    """Each quaternion of a batch for that at the other end."""
    return tuple(part[::-1] for part in quats)


def scipy_of(quats):
    return Rotation.from_quat(np.stack(quats, axis=-1))


@pytest.fixture
def rotation_vectors():
    """Rotation vectors in every direction, up to half a turn, three arrays of shape (n,)."""
    rng = np.random.default_rng(5)
    direction = rng.normal(size=(3, MANY))
    return tuple(direction / np.linalg.norm(direction, axis=0) * rng.uniform(0.0, np.pi, MANY))


@pytest.fixture
def quats(rotation_vectors):
    return tuple(Rotation.from_rotvec(np.stack(rotation_vectors, axis=-1)).as_quat().T)


def test_the_exponential_is_scipy_s(rotation_vectors, quats):
    np.testing.assert_allclose(attitude.exponential(rotation_vectors), quats, atol=1e-15)


def test_the_logarithm_undoes_the_exponential_for_either_sign(rotation_vectors, quats):
    for q in (quats, tuple(-part for part in quats)):
        np.testing.assert_allclose(attitude.logarithm(q), rotation_vectors, atol=1e-13)


@pytest.mark.parametrize("size", [0.0, 1e-12, 1e-7, 1e-5])
def test_tiny_rotations_survive_both_ways(size):
    vector = size * np.array([0.6, -0.8, 0.0])
    found = attitude.logarithm(attitude.exponential(tuple(vector)))
    np.testing.assert_allclose(found, vector, rtol=1e-12, atol=1e-20)


def test_products_inverses_and_turned_vectors_are_scipy_s(quats):
    first, second = scipy_of(quats), scipy_of(backwards(quats))
    product = attitude.product(quats, backwards(quats))
    np.testing.assert_allclose(product, (first * second).as_quat(canonical=False).T, atol=1e-14)
    vector = np.random.default_rng(6).normal(size=(3, MANY))
    np.testing.assert_allclose(attitude.turn(quats, tuple(vector)), first.apply(vector.T).T, atol=1e-13)
    np.testing.assert_allclose(
        attitude.turn_back(quats, tuple(vector)), first.inv().apply(vector.T).T, atol=1e-13
    )


def test_turning_a_body_by_its_rotation_error_gives_the_target(quats):
    target = backwards(quats)
    error = attitude.rotation_error(quats, target)
    reached = attitude.product(quats, attitude.exponential(error))
    assert attitude.angle_between(reached, target).max() < 1e-7
    np.testing.assert_allclose(attitude.length(error), attitude.angle_between(quats, target), atol=1e-7)


def test_euler_angles_are_roll_pitch_yaw_of_ros(quats):
    angles = attitude.euler_of(quats)
    expected = scipy_of(quats).as_euler("xyz").T
    np.testing.assert_allclose(angles, expected, atol=1e-9)
    assert attitude.angle_between(attitude.from_euler(*angles), quats).max() < 1e-7


@pytest.mark.parametrize("pitch", [np.pi / 2.0, -np.pi / 2.0])
def test_euler_angles_straight_up_and_down_give_the_attitude_back(pitch):
    q = attitude.from_euler(np.array(0.3), np.array(pitch), np.array(-0.8))
    assert attitude.angle_between(attitude.from_euler(*attitude.euler_of(q)), q) < 1e-6


def test_the_first_rows_are_those_of_the_rotation_matrix(quats):
    rows = scipy_of(quats).as_matrix()[:, :2, :].reshape(MANY, 6).T
    np.testing.assert_allclose(attitude.first_rows(quats), rows, atol=1e-14)


def test_drawn_attitudes_are_uniform_over_all_rotations():
    # The angle of a uniform rotation has the density (1 − cos θ)/π: its mean is π/2 + 2/π, and every axis is alike.
    draws = Draws(3, np.arange(20_000), np.zeros(20_000, dtype=int), START)
    numbers = draws.uniform(0.0, 1.0, 3)
    q = attitude.uniform_attitude(*numbers.T)
    np.testing.assert_allclose(np.linalg.norm(q, axis=0), 1.0, atol=1e-12)
    angle = attitude.length(attitude.logarithm(q))
    assert angle.mean() == pytest.approx(np.pi / 2.0 + 2.0 / np.pi, abs=0.015)
    up = (np.zeros_like(angle), np.zeros_like(angle), np.ones_like(angle))
    turned = np.array(attitude.turn(q, up))
    np.testing.assert_allclose(turned.mean(axis=1), 0.0, atol=0.015)
    np.testing.assert_allclose((turned**2).mean(axis=1), 1.0 / 3.0, atol=0.01)


def test_drawn_attitudes_tilt_no_further_than_they_may_and_head_anywhere():
    numbers = np.random.default_rng(3).uniform(size=(3, 20_000))
    q = attitude.uniform_attitude(*numbers, tilt_deg=30.0)
    np.testing.assert_allclose(np.linalg.norm(q, axis=0), 1.0, atol=1e-12)
    x, y, up = attitude.turn(q, (np.zeros(20_000), np.zeros(20_000), np.ones(20_000)))
    # Of a cap of a sphere the height is uniform.
    least = np.cos(np.radians(30.0))
    assert up.min() >= least - 1e-12
    assert up.mean() == pytest.approx(0.5 * (1.0 + least), abs=1e-3)
    np.testing.assert_allclose((x.mean(), y.mean()), 0.0, atol=0.01)
    heading = attitude.euler_of(q)[2]
    assert heading.mean() == pytest.approx(0.0, abs=0.05)
    assert heading.std() == pytest.approx(np.pi / np.sqrt(3.0), abs=0.02)


def test_drawn_directions_are_uniform_over_the_sphere():
    rng = np.random.default_rng(7)
    direction = np.array(attitude.uniform_direction(*rng.uniform(size=(2, 20_000))))
    np.testing.assert_allclose(np.linalg.norm(direction, axis=0), 1.0, atol=1e-12)
    np.testing.assert_allclose(direction.mean(axis=1), 0.0, atol=0.015)
    np.testing.assert_allclose((direction**2).mean(axis=1), 1.0 / 3.0, atol=0.01)


@pytest.mark.parametrize("count", [60, 4096])
def test_even_directions_leave_no_gap_on_the_sphere(count):
    directions = attitude.even_directions(count)
    assert directions.shape == (count, 3)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(directions.mean(axis=0), 0.0, atol=0.5 / count)
    anywhere = np.random.default_rng(1).normal(size=(2000, 3))
    anywhere /= np.linalg.norm(anywhere, axis=1, keepdims=True)
    nearest = np.arccos(np.clip((anywhere @ directions.T).max(axis=1), -1.0, 1.0))
    assert nearest.max() < 1.2 * np.sqrt(4.0 * np.pi / count)
