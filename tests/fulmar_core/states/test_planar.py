"""Motion in the plane."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fulmar_core.states.planar import PlanarState, at_rest, to_body, wrapped
from tests.states import planar_state


def crowd(count=20, seed=1):
    return PlanarState(*np.random.default_rng(seed).normal(size=(6, count)))


def test_the_planar_part_of_a_rigid_state_is_what_went_in():
    state = crowd()
    back = PlanarState.from_rigid(state.to_rigid())
    for name in PlanarState.COLUMNS:
        np.testing.assert_allclose(getattr(back, name), getattr(state, name), rtol=0, atol=1e-12)


def test_a_rigid_state_made_from_a_planar_one_does_not_leave_the_plane():
    rigid = crowd().to_rigid()
    assert not rigid.position_in_world[:, 2].any()
    assert not rigid.velocity_in_world[:, 2].any()
    assert not rigid.quat_xyzw[:, :2].any()
    assert not rigid.angular_velocity_in_body[:, :2].any()


def test_a_rigid_state_is_read_without_a_batch_axis_too():
    state = PlanarState.from_rigid(planar_state(1.0, 2.0, 0.5, vx=0.1, vy=0.2, yaw_rate=0.3))
    assert [float(getattr(state, name)) for name in PlanarState.COLUMNS] == pytest.approx(
        [1.0, 2.0, 0.5, 0.1, 0.2, 0.3]
    )


def test_what_lies_ahead_of_a_body_that_looks_north_lies_north():
    x, y = to_body(np.array(np.pi / 2), np.array(0.0), np.array(3.0))
    assert (float(x), float(y)) == pytest.approx((3.0, 0.0), abs=1e-12)
    x, y = to_body(np.array(np.pi / 2), np.array(-2.0), np.array(0.0))  # west of it is its left
    assert (float(x), float(y)) == pytest.approx((0.0, 2.0), abs=1e-12)


def test_the_velocity_in_the_body_has_the_length_of_that_in_the_world():
    state = crowd()
    np.testing.assert_allclose(np.hypot(*state.velocity_in_body), state.speed, rtol=0, atol=1e-12)


@settings(derandomize=True, deadline=None)
@given(angle=st.floats(-1e3, 1e3))
def test_a_wrapped_angle_is_the_same_angle_within_half_a_turn(angle):
    same = float(wrapped(np.asarray(angle)))
    assert abs(same) <= np.pi + 1e-12
    assert np.cos(same) == pytest.approx(np.cos(angle), abs=1e-9)
    assert np.sin(same) == pytest.approx(np.sin(angle), abs=1e-9)


def test_writing_and_picking_touch_the_asked_worlds_alone():
    state, other = crowd(5), crowd(2, seed=2)
    before = state[np.arange(5)]
    state.write([1, 3], other)
    for name in PlanarState.COLUMNS:
        np.testing.assert_array_equal(getattr(state, name)[[1, 3]], getattr(other, name))
        np.testing.assert_array_equal(getattr(state, name)[[0, 2, 4]], getattr(before, name)[[0, 2, 4]])


def test_a_body_at_rest_does_not_move():
    state = at_rest(np.array([1.0]), np.array([2.0]), np.array([3.0]))
    assert (state.x[0], state.y[0], state.yaw[0]) == (1.0, 2.0, 3.0)
    assert not any(getattr(state, name).any() for name in ("vx", "vy", "yaw_rate"))


def test_states_stack_along_any_new_axis():
    states = [crowd(4, seed=i) for i in range(3)]
    assert PlanarState.stack(states).x.shape == (3, 4)
    assert PlanarState.stack(states, axis=-1).x.shape == (4, 3)
    np.testing.assert_array_equal(PlanarState.stack(states)[1].vy, states[1].vy)
