"""Newton and Euler: what has a closed form, and what may not change."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fulmar_core.dynamics.rigid_body import Disturbance, MassProperties, step
from fulmar_core.rotation import from_yaw, rotate
from fulmar_core.state import RigidBodyState, planar_state

BODY = MassProperties(np.array([5.0]), np.array([0.1, 0.2, 0.25]))
CALM = Disturbance(np.zeros(3), np.zeros(3))
ROUNDING = 1e-12  # hundreds of float64 operations on numbers of order 1


def tumbling() -> RigidBodyState:
    quat = np.array([0.1, -0.2, 0.3, 0.9])
    return RigidBodyState(
        np.zeros(3), quat / np.linalg.norm(quat), np.array([0.3, -0.2, 0.1]), np.array([0.5, 1.5, -0.7])
    )


def momenta(state: RigidBodyState) -> tuple[np.ndarray, np.ndarray]:
    return BODY.mass * state.velocity_in_world, rotate(
        state.quat_xyzw, BODY.inertia * state.angular_velocity_in_body
    )


def test_a_constant_force_gives_the_semi_implicit_sum_of_a_double_integrator():
    dt, n, force = 0.01, 50, np.array([2.0, -1.0, 0.5])
    state = RigidBodyState(
        np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]), np.array([0.1, 0.2, 0.3]), np.zeros(3)
    )
    after = step(state, force, np.zeros(3), body=BODY, disturbance=CALM, planar=False, dt=dt, substeps=n)
    v0, a = state.velocity_in_world, force / BODY.mass
    np.testing.assert_allclose(after.velocity_in_world, v0 + a * n * dt, rtol=0, atol=ROUNDING)
    expected = v0 * n * dt + a * dt * dt * n * (n + 1) / 2  # new velocity moves the position
    np.testing.assert_allclose(after.position_in_world, expected, rtol=0, atol=ROUNDING)


def test_a_constant_torque_turns_a_planar_body_by_the_same_sum():
    dt, n, torque = 0.02, 10, 0.31
    after = step(
        planar_state(0.0, 0.0, 0.4), np.zeros(3), np.array([0.0, 0.0, torque]),
        body=BODY, disturbance=CALM, planar=True, dt=dt, substeps=n,
    )  # fmt: skip
    a = torque / 0.25
    assert after.yaw == pytest.approx(0.4 + a * dt * dt * n * (n + 1) / 2, abs=ROUNDING)
    assert after.angular_velocity_in_body[2] == pytest.approx(a * n * dt, abs=ROUNDING)


def test_a_body_force_turns_with_the_body():
    after = step(
        planar_state(0.0, 0.0, np.pi / 2), np.array([1.0, 0.0, 0.0]), np.zeros(3),
        body=BODY, disturbance=CALM, planar=True, dt=0.1,
    )  # fmt: skip
    np.testing.assert_allclose(after.velocity_in_world, [0.0, 0.02, 0.0], rtol=0, atol=ROUNDING)


def test_a_disturbance_stays_in_the_world_however_the_body_points():
    push = Disturbance(np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 0.1]))
    for planar in (True, False):
        after = step(
            planar_state(0.0, 0.0, 2.0),
            np.zeros(3),
            np.zeros(3),
            body=BODY,
            disturbance=push,
            planar=planar,
            dt=0.1,
        )
        np.testing.assert_allclose(after.velocity_in_world, [0.02, 0.0, 0.0], rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(after.angular_velocity_in_body, [0.0, 0.0, 0.04], rtol=0, atol=ROUNDING)


def test_a_world_torque_acts_about_world_axes_on_a_tilted_body():
    tilted = RigidBodyState(
        np.zeros(3), np.array([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]), np.zeros(3), np.zeros(3)
    )
    twist = Disturbance(
        np.zeros(3), np.array([0.0, 0.0, 0.1])
    )  # world z is the body's y after a quarter roll
    after = step(tilted, np.zeros(3), np.zeros(3), body=BODY, disturbance=twist, planar=False, dt=0.1)
    np.testing.assert_allclose(after.angular_velocity_in_body, [0.0, 0.05, 0.0], rtol=0, atol=ROUNDING)


@settings(derandomize=True, deadline=None, max_examples=50)
@given(
    force=st.tuples(*[st.floats(-5, 5)] * 3),
    torque=st.tuples(*[st.floats(-5, 5)] * 3),
    push=st.tuples(*[st.floats(-1, 1)] * 3),
    yaw=st.floats(-3, 3),
)
def test_a_planar_body_never_leaves_its_plane_whatever_pushes(force, torque, push, yaw):
    wrench = Disturbance(np.array(push), np.array(push))
    after = step(
        planar_state(0.5, 0.5, yaw, vx=0.1, yaw_rate=0.2), np.array(force), np.array(torque),
        body=BODY, disturbance=wrench, planar=True, dt=0.02, substeps=10,
    )  # fmt: skip
    assert after.position_in_world[2] == 0.0
    assert after.velocity_in_world[2] == 0.0
    assert after.quat_xyzw[:2].tolist() == [0.0, 0.0]
    assert after.angular_velocity_in_body[:2].tolist() == [0.0, 0.0]


def test_without_forces_linear_momentum_is_kept_exactly():
    before = tumbling()
    after = step(
        before, np.zeros(3), np.zeros(3), body=BODY, disturbance=CALM, planar=False, dt=0.001, substeps=500
    )
    np.testing.assert_array_equal(momenta(after)[0], momenta(before)[0])


def test_a_free_tumble_keeps_angular_momentum_and_energy_to_the_order_of_the_step():
    before = tumbling()
    drifts = []
    for dt in (0.002, 0.001):
        after = step(
            before,
            np.zeros(3),
            np.zeros(3),
            body=BODY,
            disturbance=CALM,
            planar=False,
            dt=dt,
            substeps=round(1.0 / dt),
        )
        energy = [0.5 * np.sum(BODY.inertia * s.angular_velocity_in_body**2) for s in (before, after)]
        drifts.append((np.linalg.norm(momenta(after)[1] - momenta(before)[1]), abs(energy[1] - energy[0])))
        # It does tumble: a body that just kept its rates would pass everything else here.
        assert np.linalg.norm(after.angular_velocity_in_body - before.angular_velocity_in_body) > 0.1
    momentum = np.linalg.norm(momenta(before)[1])
    assert drifts[1][0] < 2e-3 * momentum  # first order: about dt times the turn rate, over one second
    # Half the step, half the drift: what is lost is the integrator's, not the equations'.
    assert drifts[0][0] / drifts[1][0] == pytest.approx(2.0, rel=0.1)
    assert drifts[0][1] / drifts[1][1] == pytest.approx(2.0, rel=0.1)


def test_a_quaternion_that_has_lost_its_length_gets_it_back():
    worn = tumbling()
    worn = RigidBodyState(worn.position_in_world, 1.001 * worn.quat_xyzw, worn.velocity_in_world, np.zeros(3))
    after = step(
        worn, np.zeros(3), np.zeros(3), body=BODY, disturbance=CALM, planar=False, dt=0.02, substeps=3
    )
    assert np.linalg.norm(after.quat_xyzw) == pytest.approx(1.0, abs=ROUNDING)


def test_substeps_are_the_same_as_single_steps():
    force, torque = np.array([0.3, 0.1, 0.2]), np.array([0.01, -0.02, 0.03])
    many = step(tumbling(), force, torque, body=BODY, disturbance=CALM, planar=False, dt=0.02, substeps=10)
    single = tumbling()
    for _ in range(10):
        single = step(single, force, torque, body=BODY, disturbance=CALM, planar=False, dt=0.02)
    np.testing.assert_allclose(many.position_in_world, single.position_in_world, rtol=0, atol=ROUNDING)
    np.testing.assert_allclose(many.quat_xyzw, single.quat_xyzw, rtol=0, atol=ROUNDING)


def test_each_body_of_a_batch_moves_as_it_would_alone():
    rng = np.random.default_rng(3)
    n = 4
    body = MassProperties(rng.uniform(1, 9, (n, 1)), rng.uniform(0.1, 0.3, (n, 3)))
    push = Disturbance(rng.normal(size=(n, 3)), rng.normal(size=(n, 3)))
    quat = from_yaw(rng.normal(size=n))
    state = RigidBodyState(rng.normal(size=(n, 3)), quat, rng.normal(size=(n, 3)), rng.normal(size=(n, 3)))
    force, torque = rng.normal(size=(2, n, 3))
    for planar in (True, False):
        kwargs = {"planar": planar, "dt": 0.02, "substeps": 5}
        together = step(state, force, torque, body=body, disturbance=push, **kwargs)
        for i in range(n):
            alone = step(
                state[i], force[i], torque[i],
                body=MassProperties(body.mass[i], body.inertia[i]),
                disturbance=Disturbance(push.force_in_world[i], push.torque_in_world[i]),
                **kwargs,
            )  # fmt: skip
            np.testing.assert_allclose(
                together[i].position_in_world, alone.position_in_world, rtol=0, atol=ROUNDING
            )
            np.testing.assert_allclose(together[i].quat_xyzw, alone.quat_xyzw, rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("planar", [True, False])
def test_the_step_stays_on_the_device_of_its_arrays(planar):
    torch = pytest.importorskip("torch")
    # torch's "meta" device refuses to be mixed with the CPU, as a GPU does, and exists everywhere.
    zeros, quat = torch.zeros(2, 3, device="meta"), torch.zeros(2, 4, device="meta")
    body = MassProperties(torch.ones(2, 1, device="meta"), torch.ones(2, 3, device="meta"))
    after = step(
        RigidBodyState(zeros, quat, zeros, zeros), zeros, zeros,
        body=body, disturbance=Disturbance(zeros, zeros), planar=planar, dt=0.02,
    )  # fmt: skip
    assert after.position_in_world.device.type == "meta"
