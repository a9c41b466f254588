"""The state that every part of Fulmar speaks."""

from __future__ import annotations

import numpy as np

from fulmar_core.state import planar_pose, planar_state, stack_poses, stack_states


def test_a_planar_state_is_a_six_dof_state_with_zeros():
    state = planar_state(1.0, 2.0, 0.5, vx=0.1, vy=0.2, yaw_rate=0.3)
    assert state.position_in_world.tolist() == [1.0, 2.0, 0.0]
    assert state.velocity_in_world.tolist() == [0.1, 0.2, 0.0]
    assert state.angular_velocity_in_body.tolist() == [0.0, 0.0, 0.3]
    np.testing.assert_allclose(state.yaw, 0.5, atol=1e-12)


def test_planar_states_broadcast_their_arguments():
    assert planar_state(np.zeros(4), 1.0, 0.0).position_in_world.shape == (4, 3)


def test_picking_from_a_stack_gives_the_state_that_went_in():
    states = [planar_state(float(i), -i, 0.1 * i, vx=i, yaw_rate=i) for i in range(3)]
    picked = stack_states(states)[2]
    for name in ("position_in_world", "quat_xyzw", "velocity_in_world", "angular_velocity_in_body"):
        np.testing.assert_array_equal(getattr(picked, name), getattr(states[2], name))


def test_writing_touches_the_asked_world_alone():
    batch = planar_state(np.zeros(3), np.zeros(3), np.zeros(3))
    batch.write(1, planar_state(5.0, 6.0, 1.0, vx=2.0, yaw_rate=3.0))
    assert batch.position_in_world[:, 0].tolist() == [0.0, 5.0, 0.0]
    assert batch.velocity_in_world[:, 0].tolist() == [0.0, 2.0, 0.0]
    assert batch.angular_velocity_in_body[:, 2].tolist() == [0.0, 3.0, 0.0]
    np.testing.assert_allclose(batch.yaw, [0.0, 1.0, 0.0], atol=1e-12)


def test_poses_stack_and_overwrite_like_states():
    batch = stack_poses([planar_pose(0.0, 0.0, 0.0), planar_pose(1.0, 1.0, 1.0)])
    batch.write(0, planar_pose(7.0, 8.0, 0.0))
    assert batch.position_in_world[:, :2].tolist() == [[7.0, 8.0], [1.0, 1.0]]


def test_astype_changes_every_array():
    state = planar_state(1.0, 2.0, 0.5).astype(np.float32)
    parts = (
        state.position_in_world,
        state.quat_xyzw,
        state.velocity_in_world,
        state.angular_velocity_in_body,
    )
    assert {part.dtype for part in parts} == {np.dtype(np.float32)}
