"""Linear models of bodies in space against the dynamics that batches run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.dynamics.linear_model import linearise, linearise_wrench
from fulmar_core.dynamics.rigid_body import inertia_of, rigid_body_step
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.attitude import exponential, minus, plus, product, rotation_error, turn, turn_back
from fulmar_core.states.spatial import SpatialState

ROBOT = load_robot("spacecraft_16")
# A body without symmetries, whose gyroscopic torque shows.
TENSOR = (0.20, 0.26, 0.33, 0.02, -0.03, 0.04)
UNEVEN = replace(ROBOT, body=replace(ROBOT.body, inertia=TENSOR))
DT = ROBOT.timing.control_s
QUAT = tuple(
    np.asarray(part) for part in np.array([0.3, -0.4, 0.5, 0.7]) / np.linalg.norm([0.3, -0.4, 0.5, 0.7])
)
SPINNING = SpatialState(
    *(np.asarray(v) for v in (0.4, -1.2, 2.0)),
    *QUAT,
    *(np.asarray(v) for v in (0.2, -0.1, 0.3)),
    *(np.asarray(v) for v in (0.4, -0.3, 0.5)),
)
WRENCH = np.array([0.3, -0.2, 0.1, 0.02, -0.05, 0.03])


def three(values):
    return tuple(np.asarray(value) for value in values)


def after(state, wrench):
    """One control step of the uneven body."""
    for _ in range(UNEVEN.timing.substeps(1.0 / DT)):
        force, torque = three(wrench[:3]), three(wrench[3:])
        state = rigid_body_step(
            state, force, torque, None, UNEVEN.body.mass, inertia_of(TENSOR), UNEVEN.timing.physics_dt
        )
    return state


def departed(state, x):
    return SpatialState(
        *plus(state.position, turn(state.quat, three(x[:3]))),
        *product(state.quat, exponential(three(x[3:6]))),
        *plus(state.velocity, turn(state.quat, three(x[6:9]))),
        *plus(state.rate, three(x[9:])),
    )


def departure(of, from_):
    return np.array(
        [
            *turn_back(from_.quat, minus(of.position, from_.position)),
            *rotation_error(from_.quat, of.quat),
            *turn_back(from_.quat, minus(of.velocity, from_.velocity)),
            *minus(of.rate, from_.rate),
        ]
    )


@pytest.mark.parametrize("state", [SPINNING, SPINNING.stopped()], ids=["spinning", "at rest"])
def test_it_predicts_a_step_of_twelve_departures_and_six_of_the_wrench(state):
    model = linearise_wrench(UNEVEN, state, WRENCH, DT)
    assert (model.a.shape, model.b.shape) == ((12, 12), (12, 6))
    rng, small, end = np.random.default_rng(7), 1e-3, after(state, WRENCH)
    for _ in range(10):
        dx, du = small * rng.uniform(-1.0, 1.0, 12), small * rng.uniform(-1.0, 1.0, 6)
        found = departure(after(departed(state, dx), WRENCH + du), end)
        assert np.abs(found).max() > 1e-4
        # What a linear model leaves out is of second order.
        np.testing.assert_allclose(model.a @ dx + model.b @ du, found, rtol=0, atol=5.0 * small**2)


def test_at_rest_it_is_six_double_integrators_and_the_inertia_couples_only_torques():
    model = linearise_wrench(UNEVEN, SPINNING.stopped(), np.zeros(6), DT)
    inverse = np.linalg.inv(UNEVEN.body.inertia_matrix)
    integrator = np.eye(12) + DT * np.eye(12, k=6)
    np.testing.assert_allclose(model.a, integrator, atol=1e-8)
    np.testing.assert_allclose(model.b[6:9, :3], DT / UNEVEN.body.mass * np.eye(3), atol=1e-8)
    np.testing.assert_allclose(model.b[9:, 3:], DT * inverse, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(model.b[3:6, 3:], 0.5 * DT**2 * inverse, rtol=1e-5, atol=1e-7)


def test_the_model_of_commands_is_that_of_the_wrenches_behind_them():
    actuators, opened = UNEVEN.actuators, np.full(16, 0.02)  # below the shared line's limit
    wrench = opened @ (actuators.full_thrust[:, None] * actuators.wrench_per_newton)
    by_wrench = linearise_wrench(UNEVEN, SPINNING, wrench, DT)
    by_command = linearise(UNEVEN, SPINNING, opened, DT)
    per_command = (actuators.full_thrust[:, None] * actuators.wrench_per_newton).T
    np.testing.assert_allclose(by_command.a, by_wrench.a, atol=1e-6)
    np.testing.assert_allclose(by_command.b, by_wrench.b @ per_command, atol=1e-6)
