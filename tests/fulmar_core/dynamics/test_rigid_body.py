"""A rigid body in space: what it keeps, where the closed form takes it, and the same in NumPy and torch."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.config.paths import config_names
from fulmar_core.dynamics.rigid_body import inertia_of, rigid_body_step, shifted
from fulmar_core.dynamics.tumble import (
    MOMENTS,
    RATE,
    drift_over,
    drifts,
    jacobi_rate,
    measured_order,
    torque_free,
    tumbling,
)
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.attitude import exponential, times, turn, uniform_attitude
from fulmar_core.states.spatial import SpatialState
from fulmar_core.worlds.spatial_world import gravity_gradient_torque

STEP_S = 0.05
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
ORIGIN = (0.0, 0.0, 0.0)
IN_SPACE = [
    robot for robot in map(load_robot, config_names("robots")) if issubclass(robot.state_type, SpatialState)
]


def state_of(*values, like=np.float64):
    """A body from thirteen numbers or arrays."""
    return SpatialState(*(np.asarray(value, dtype=like) for value in values))


def vector(*values):
    """Three arrays without a batch."""
    return tuple(map(np.asarray, values))


def inertia(entries, like=np.float64):
    return inertia_of(tuple(np.asarray(entry, dtype=like) for entry in entries))


# ω₂ = 0 at the start; the second one goes near the separatrix, where motion about the middle axis is unstable.
TUMBLES = pytest.mark.parametrize("rate", [(1.0, 0.0, 1.2), (1.0, 0.0, 0.6)])


@pytest.mark.slow
@pytest.mark.parametrize("robot", IN_SPACE, ids=lambda robot: robot.name)
def test_the_step_of_each_robot_in_space_keeps_energy_and_momentum_over_an_hour(robot):
    """Of the tumble that issue 36 asks for: I = (1, 2, 3) kg·m², 0.3 rad/s."""
    found = drift_over(3600.0, robot.timing.physics_dt)
    assert found.energy < 1e-9
    assert found.momentum < 1e-9
    assert found.from_jacobi < 1e-6


@TUMBLES
def test_a_torque_free_tumble_keeps_what_it_has_and_follows_jacobi_for_a_minute(rate):
    body, start = inertia(MOMENTS), tumbling(rate)
    end = torque_free(start, body, 60.0, STEP_S)
    assert max(drifts(start, end, body)) < 1e-9
    np.testing.assert_allclose(end.rate, jacobi_rate(start.rate, 60.0), rtol=0, atol=1e-8 * RATE)


def test_the_step_is_of_fourth_order():
    """Half the step, a sixteenth of the error of attitude and rate; a thirteenth at least."""
    assert measured_order() > np.log2(13.0)


def test_single_precision_drifts_more_and_is_looked_at_in_double():
    double, single = (drift_over(130.0, STEP_S, like) for like in (np.float64, np.float32))
    assert double.energy < 1e-9 < 1e-8 < single.energy < 1e-4
    assert single.from_jacobi > double.from_jacobi


def test_the_attitude_stays_a_unit_quaternion_in_float32():
    end = torque_free(tumbling((1.0, 0.5, 1.2), np.float32), inertia(MOMENTS, np.float32), 120.0, STEP_S)
    assert {column.dtype for column in end.columns()} == {np.dtype(np.float32)}
    assert abs(np.linalg.norm(end.quat) - 1.0) < 1e-6


def test_a_full_tensor_turns_like_the_principal_one_seen_from_its_axes():
    tilt = exponential(vector(0.4, -0.7, 0.2))
    axes = np.stack([turn(tilt, tuple(axis)) for axis in np.eye(3)], axis=1)  # principal axes in the body
    matrix = axes @ np.diag(MOMENTS) @ axes.T
    entries = matrix[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    straight = tumbling((1.0, 0.3, 1.2))
    tilted = state_of(*ORIGIN, *UPRIGHT, *ORIGIN, *(axes @ np.array(straight.rate)))
    expected = torque_free(straight, inertia(MOMENTS), 20.0, STEP_S)
    found = torque_free(tilted, inertia(entries), 20.0, STEP_S)
    np.testing.assert_allclose(found.rate, axes @ np.array(expected.rate), atol=1e-12)


@pytest.mark.parametrize("entries", [MOMENTS, (1.0, 2.0, 3.0, 0.1, -0.2, 0.3)])
def test_the_inverse_of_an_inertia_undoes_it(entries):
    body, some = inertia(entries), (0.3, -1.0, 2.0)
    np.testing.assert_allclose(times(body.inverse, times(body.tensor, some)), some, atol=1e-14)


def test_a_constant_force_moves_the_body_as_a_parabola_and_a_torque_spins_it_up():
    state = state_of(*ORIGIN, *UPRIGHT, *ORIGIN, *ORIGIN)
    for _ in range(40):
        state = rigid_body_step(
            state, ORIGIN, (0.0, 0.0, 0.6), (1.0, 0.0, -2.0), np.asarray(4.0), inertia(MOMENTS), STEP_S
        )
    np.testing.assert_allclose(state.position, [0.5, 0.0, -1.0], atol=1e-12)
    np.testing.assert_allclose(state.velocity, [0.5, 0.0, -1.0], atol=1e-12)
    np.testing.assert_allclose(state.rate, [0.0, 0.0, 0.4], atol=1e-12)
    # ½ · 0.2 rad/s² · (2 s)² = 0.4 rad
    np.testing.assert_allclose(state.quat, [0.0, 0.0, np.sin(0.2), np.cos(0.2)], atol=1e-12)


def test_a_body_force_turns_with_the_body():
    # Half a turn in which the push keeps pointing ahead: the impulse goes to the left, 2 F/(m ω).
    rate, force = np.pi / 10.0, 2.0
    state = state_of(*ORIGIN, *UPRIGHT, *ORIGIN, 0.0, 0.0, rate)
    for _ in range(200):
        state = rigid_body_step(
            state, (force, 0.0, 0.0), ORIGIN, None, np.asarray(1.0), inertia(MOMENTS), STEP_S
        )
    np.testing.assert_allclose(state.velocity, [0.0, 2.0 * force / rate, 0.0], rtol=1e-4, atol=1e-9)


def some_states(count, seed):
    rng = np.random.default_rng(seed)
    quat = uniform_attitude(*rng.uniform(size=(3, count)))
    return SpatialState(*rng.normal(size=(3, count)), *quat, *rng.normal(size=(6, count)))


def test_the_way_to_the_mass_center_and_back_changes_nothing():
    state, offset = some_states(5, 1), np.random.default_rng(4).normal(size=(3, 5))
    there = shifted(state, tuple(offset))
    assert np.abs(np.array(there.velocity) - np.array(state.velocity)).max() > 0.1
    back = shifted(there, tuple(-offset))
    np.testing.assert_allclose(back.columns(), state.columns(), atol=1e-12)


def test_the_gravity_gradient_pulls_the_long_axis_towards_the_planet():
    # A rod along x, tipped a little from the vertical: the torque turns it back.
    tipped = SpatialState.at_rest(vector(*ORIGIN), exponential(vector(0.0, np.pi / 2 - 0.1, 0.0)))
    torque = gravity_gradient_torque(tipped, inertia((0.1, 2.0, 2.0)).tensor, 1e-3)
    assert torque[1] == pytest.approx(3e-6 * 1.9 * np.sin(0.1) * np.cos(0.1), rel=1e-9)
    assert (torque[0], torque[2]) == pytest.approx((0.0, 0.0), abs=1e-18)


@pytest.mark.parametrize("entries", [3, 6])
def test_torch_and_numpy_move_a_body_alike(entries):
    torch = pytest.importorskip("torch")
    rng, states = np.random.default_rng(2), some_states(7, 3)
    force, torque, push = rng.normal(size=(3, 3, 7))
    tensor = np.tile(np.array([1.0, 2.0, 3.0, 0.1, -0.2, 0.3])[:entries, None], 7)
    mass = rng.uniform(1.0, 2.0, 7)

    def moved(of):
        state, body = SpatialState(*map(of, states.columns())), inertia_of(tuple(map(of, tensor)))
        forces = [tuple(map(of, part)) for part in (force, torque, push)]
        for _ in range(20):
            state = rigid_body_step(state, *forces, of(mass), body, STEP_S)
        return np.stack([np.asarray(column) for column in state.columns()])

    np.testing.assert_allclose(moved(torch.as_tensor), moved(np.asarray), atol=1e-12)


def test_the_wire_form_of_a_state_has_its_components_last():
    state = some_states(4, 3)
    rigid = state.to_rigid()
    assert rigid.position_in_world.shape == (4, 3)
    assert rigid.quat_xyzw.shape == (4, 4)
    np.testing.assert_array_equal(SpatialState.from_rigid(rigid).columns(), state.columns())


def test_some_worlds_of_a_batch_are_overwritten_and_the_others_stay():
    state, other = some_states(3, 5), some_states(1, 6)
    kept = np.array(state.columns())
    state.write([1], other)
    np.testing.assert_array_equal(np.array(state.columns())[:, [1]], other.columns())
    np.testing.assert_array_equal(np.array(state.columns())[:, [0, 2]], kept[:, [0, 2]])
