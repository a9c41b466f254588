"""A rigid body in space: what it keeps, where the closed form takes it, and the same in NumPy and torch."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ellipj

from fulmar_core.attitude import exponential, turn, uniform_attitude
from fulmar_core.dynamics.rigid_body import (
    Inertia,
    angular_momentum_in_world,
    gravity_gradient_torque,
    inertia_of,
    kinetic_energy,
    principal_inertia,
    rigid_body_step,
    shifted,
    times,
)
from fulmar_core.spatial import PARTS, SpatialState, at_rest_in_space, rigid_of_spatial, spatial_of

MOMENTS = np.array([1.0, 2.0, 3.0])  # of an asymmetric body [kg·m²]
STEP_S = 0.05
RATE = 0.3  # of the tumble [rad/s]


def tumbling(rate, dtype=np.float64):
    """A body at the origin that only turns."""
    zero = np.zeros(3, dtype)
    return SpatialState(
        zero, np.array([0.0, 0.0, 0.0, 1.0], dtype), zero, (rate * RATE / np.linalg.norm(rate)).astype(dtype)
    )


def after(state, inertia, seconds, dt=STEP_S):
    """The state of a torque-free body later."""
    zero = np.zeros_like(state.turn_rate)
    mass = state.position.dtype.type(1.0)
    for _ in range(round(seconds / dt)):
        state = rigid_body_step(state, zero, zero, None, mass, inertia, dt)
    return state


@pytest.fixture(scope="module")
def hour():
    """A tumble, before and after an hour."""
    inertia = inertia_of(MOMENTS)
    start = tumbling(np.array([1.0, 0.0, 1.2]))
    return start, after(start, inertia, 3600.0), inertia


@pytest.mark.slow
def test_a_torque_free_tumble_keeps_its_energy_and_momentum_over_an_hour(hour):
    start, end, inertia = hour
    energy = kinetic_energy(start, 1.0, inertia)
    momentum = angular_momentum_in_world(start, inertia)
    assert abs(kinetic_energy(end, 1.0, inertia) / energy - 1.0) < 1e-9
    drift = np.linalg.norm(angular_momentum_in_world(end, inertia) - momentum)
    assert drift / np.linalg.norm(momentum) < 1e-9


@pytest.mark.slow
def test_a_torque_free_tumble_follows_jacobi_s_closed_form_over_an_hour(hour):
    start, end, _ = hour
    np.testing.assert_allclose(end.turn_rate, jacobi(start.turn_rate, 3600.0), rtol=0, atol=1e-6 * RATE)


def test_a_torque_free_tumble_follows_jacobi_s_closed_form_for_a_minute():
    start = tumbling(np.array([1.0, 0.0, 1.2]))
    end = after(start, inertia_of(MOMENTS), 60.0)
    np.testing.assert_allclose(end.turn_rate, jacobi(start.turn_rate, 60.0), rtol=0, atol=1e-8 * RATE)


def jacobi(rate, seconds):
    """Turn rate of a body that begins without a rate about its middle axis (Landau, Lifshitz, Mechanics, §37)."""
    (i1, i2, i3), (a, _, c) = MOMENTS, rate
    frequency = c * np.sqrt((i3 - i2) * (i3 - i1) / (i1 * i2))
    parameter = a**2 * i1 * (i2 - i1) / (c**2 * i3 * (i3 - i2))
    sn, cn, dn, _ = ellipj(frequency * seconds, parameter)
    return np.array([a * cn, a * np.sqrt(i1 * (i3 - i1) / (i2 * (i3 - i2))) * sn, c * dn])


def test_the_attitude_stays_a_unit_quaternion_in_float32():
    start = tumbling(np.array([1.0, 0.5, 1.2]), np.float32)
    end = after(start, inertia_of(MOMENTS.astype(np.float32)), 120.0)
    assert end.quat_xyzw.dtype == np.float32
    assert abs(np.linalg.norm(end.quat_xyzw) - 1.0) < 1e-6


def test_a_full_tensor_turns_like_the_principal_one_seen_from_its_axes():
    tilt = exponential(np.array([0.4, -0.7, 0.2]))
    axes = np.stack([turn(tilt, axis) for axis in np.eye(3)], axis=1)  # principal axes in the tilted body
    matrix = axes @ np.diag(MOMENTS) @ axes.T
    entries = matrix[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    straight = tumbling(np.array([1.0, 0.3, 1.2]))
    tilted = SpatialState(straight.position, straight.quat_xyzw, straight.velocity, axes @ straight.turn_rate)
    expected = after(straight, inertia_of(MOMENTS), 20.0)
    found = after(tilted, inertia_of(entries), 20.0)
    np.testing.assert_allclose(found.turn_rate, axes @ expected.turn_rate, atol=1e-12)
    np.testing.assert_allclose(principal_inertia(entries), MOMENTS, atol=1e-12)


def test_the_inverse_of_an_inertia_undoes_it():
    inertia = inertia_of(np.array([1.0, 2.0, 3.0, 0.1, -0.2, 0.3]))
    vector = np.array([0.3, -1.0, 2.0])
    np.testing.assert_allclose(times(inertia.inverse, times(inertia.tensor, vector)), vector, atol=1e-14)


def test_a_constant_force_moves_the_body_as_a_parabola_and_a_torque_spins_it_up():
    state = at_rest_in_space(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))
    inertia = Inertia(MOMENTS, 1.0 / MOMENTS)
    for _ in range(40):
        state = rigid_body_step(
            state, np.zeros(3), np.array([0.0, 0.0, 0.6]), np.array([1.0, 0.0, -2.0]), 4.0, inertia, STEP_S
        )
    np.testing.assert_allclose(state.position, [0.5, 0.0, -1.0], atol=1e-12)
    np.testing.assert_allclose(state.velocity, [0.5, 0.0, -1.0], atol=1e-12)
    np.testing.assert_allclose(state.turn_rate, [0.0, 0.0, 0.4], atol=1e-12)
    np.testing.assert_allclose(
        state.quat_xyzw, [0.0, 0.0, np.sin(0.2), np.cos(0.2)], atol=1e-12
    )  # ½ · 0.2 rad/s² · (2 s)² = 0.4 rad


def test_a_body_force_turns_with_the_body():
    # Half a turn in which the push keeps pointing ahead: the impulse goes to the left, 2 F/(m ω).
    rate, force = np.pi / 10.0, 2.0
    state = SpatialState(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(3), np.array([0.0, 0.0, rate]))
    inertia = inertia_of(MOMENTS)
    for _ in range(200):
        state = rigid_body_step(state, np.array([force, 0.0, 0.0]), np.zeros(3), None, 1.0, inertia, STEP_S)
    np.testing.assert_allclose(state.velocity, [0.0, 2.0 * force / rate, 0.0], rtol=1e-4, atol=1e-9)


def test_the_way_to_the_mass_center_and_back_changes_nothing():
    rng = np.random.default_rng(1)
    state = SpatialState(
        rng.normal(size=(3, 5)),
        uniform_attitude(*rng.uniform(size=(3, 5))),
        rng.normal(size=(3, 5)),
        rng.normal(size=(3, 5)),
    )
    offset = rng.normal(size=(3, 5))
    back = shifted(shifted(state, offset), -offset)
    for name in PARTS:
        np.testing.assert_allclose(getattr(back, name), getattr(state, name), atol=1e-12)


def test_the_gravity_gradient_pulls_the_long_axis_towards_the_planet():
    # A rod along x, tipped a little from the vertical: the torque turns it back.
    rod = inertia_of(np.array([0.1, 2.0, 2.0]))
    tipped = at_rest_in_space(np.zeros(3), exponential(np.array([0.0, np.pi / 2.0 - 0.1, 0.0])))
    torque = gravity_gradient_torque(tipped, rod, 1e-3)
    assert torque[1] == pytest.approx(3e-6 * 1.9 * np.sin(0.1) * np.cos(0.1), rel=1e-9)
    assert torque[[0, 2]] == pytest.approx([0.0, 0.0], abs=1e-18)


def test_torch_and_numpy_move_a_body_alike():
    torch = pytest.importorskip("torch")
    rng = np.random.default_rng(2)
    parts = (
        rng.normal(size=(3, 7)),
        uniform_attitude(*rng.uniform(size=(3, 7))),
        rng.normal(size=(3, 7)),
        rng.normal(size=(3, 7)),
    )
    force, torque, push = rng.normal(size=(3, 3, 7))
    tensor = np.tile(np.array([1.0, 2.0, 3.0, 0.1, -0.2, 0.3])[:, None], 7)
    mass = rng.uniform(1.0, 2.0, 7)

    def moved(of):
        state = SpatialState(*map(of, parts))
        inertia = inertia_of(of(tensor))
        for _ in range(20):
            state = rigid_body_step(state, of(force), of(torque), of(push), of(mass), inertia, STEP_S)
        return state

    ours, theirs = moved(np.asarray), moved(torch.as_tensor)
    for name in PARTS:
        np.testing.assert_allclose(getattr(theirs, name).numpy(), getattr(ours, name), atol=1e-12)


def test_the_wire_form_of_a_state_has_its_components_last():
    rng = np.random.default_rng(3)
    state = SpatialState(
        rng.normal(size=(3, 4)),
        uniform_attitude(*rng.uniform(size=(3, 4))),
        rng.normal(size=(3, 4)),
        rng.normal(size=(3, 4)),
    )
    rigid = rigid_of_spatial(state)
    assert rigid.position_in_world.shape == (4, 3)
    assert rigid.quat_xyzw.shape == (4, 4)
    for name in PARTS:
        np.testing.assert_array_equal(getattr(spatial_of(rigid), name), getattr(state, name))


def test_a_body_at_rest_can_be_written_without_mixing_its_motion():
    state = at_rest_in_space(np.zeros((3, 2)), np.tile([[0.0], [0.0], [0.0], [1.0]], 2))
    other = SpatialState(
        np.ones((3, 1)), np.array([[1.0], [0.0], [0.0], [0.0]]), np.full((3, 1), 2.0), np.full((3, 1), 3.0)
    )
    state.write([1], other)
    assert state.velocity[:, 1].tolist() == [2.0] * 3
    assert state.turn_rate[:, 1].tolist() == [3.0] * 3
    assert not state.velocity[:, 0].any()
