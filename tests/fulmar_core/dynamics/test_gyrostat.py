"""A body with reaction wheels keeps its momentum, and wheels keep to their limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.dynamics.gyrostat import Flywheels, gyrostat_step
from fulmar_core.dynamics.rigid_body import inertia_of, rigid_body_step
from fulmar_core.robots.actuators.reaction_wheels import ReactionWheels, Unloading, Wheel
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.attitude import plus, times, turn
from fulmar_core.states.spatial import SpatialState

MICROSAT = load_robot("microsat")
WHEELS = MICROSAT.actuators
TENSOR = tuple(np.array([entry]) for entry in (6.53, 5.96, 4.53, 0.2, -0.1, 0.3))
MASS, ZERO = np.array([95.0]), (np.zeros(1),) * 3
SKEWED = np.array([[1.0, 0.0, 0.0], [0.0, 0.6, 0.8], [0.0, -0.8, 0.6], [0.57735, 0.57735, 0.57735]])


def turning(*rate):
    zero = np.zeros(1)
    return SpatialState(*((zero,) * 6), np.ones(1), *((zero,) * 3), *(np.array([part]) for part in rate))


def momentum_in_world(state, speeds, wheels, tensor):
    """Of body and wheels about the centre of mass [N·m·s]."""
    return turn(state.quat, plus(times(tensor, state.rate), wheels.momentum(speeds)))


def driven(dt, *, seconds=30.0, axes=WHEELS.axes):
    """State and speeds after wheels were driven by torques that change."""
    wheels = Flywheels(axes, WHEELS.spin_inertia)
    state, speeds = turning(0.02, -0.05, 0.03), tuple(np.array([50.0 * i]) for i in range(len(axes)))
    begun = np.array(momentum_in_world(state, speeds, wheels, TENSOR))
    for k in range(round(seconds / dt)):
        torques = tuple(np.array([0.05 * np.sin(0.3 * i + 0.2 * k * dt)]) for i in range(len(axes)))
        state, speeds = gyrostat_step(
            state, speeds, ZERO, None, lambda _, t=torques: t, wheels, MASS, TENSOR, dt
        )
    return begun, np.array(momentum_in_world(state, speeds, wheels, TENSOR))


@pytest.mark.parametrize("axes", [WHEELS.axes, SKEWED], ids=["on the axes", "askew"])
def test_wheels_exchange_momentum_with_the_body_and_lose_none(axes):
    begun, ended = driven(0.05, axes=axes)
    assert np.abs(begun).max() > 0.1
    np.testing.assert_allclose(ended, begun, rtol=0, atol=1e-9)


def test_the_step_is_of_fourth_order():
    errors = [np.abs(np.subtract(*driven(dt))).max() for dt in (0.4, 0.2)]
    assert 12.0 < errors[0] / errors[1] < 20.0


def test_with_weightless_wheels_it_is_the_rigid_body():
    weightless = Flywheels(WHEELS.axes, 1e-15)
    state = turning(0.2, -0.5, 0.3)
    torque = tuple(np.array([part]) for part in (0.1, 0.02, -0.3))
    ours, _ = gyrostat_step(state, ZERO, torque, None, lambda _: ZERO, weightless, MASS, TENSOR, 0.05)
    theirs = rigid_body_step(state, ZERO, torque, None, MASS, inertia_of(TENSOR), 0.05)
    np.testing.assert_allclose(np.array(ours.columns()), np.array(theirs.columns()), rtol=0, atol=1e-12)


def test_a_motor_moves_the_wheel_one_way_and_the_body_the_other():
    wheels = Flywheels(WHEELS.axes, WHEELS.spin_inertia)
    torque = (np.array([0.1]), np.zeros(1), np.zeros(1))
    state, speeds = gyrostat_step(
        turning(0, 0, 0), ZERO, ZERO, None, lambda _: torque, wheels, MASS, TENSOR[:3], 1.0
    )
    assert state.wx[0] == pytest.approx(-0.1 / (6.53 - 0.002), rel=1e-6)
    # Relative to the body, which turns back.
    assert speeds[0][0] == pytest.approx(0.1 / 0.002 - state.wx[0], rel=1e-9)


class TestMotors:
    """Limits and friction of the wheels."""

    def test_at_top_speed_a_wheel_only_slows_down(self):
        top = np.full((3, 1), WHEELS.top_speed)
        assert WHEELS.motor_torque(np.full((3, 1), 0.1), top, 0.05).max() == 0.0
        assert WHEELS.motor_torque(np.full((3, 1), -0.1), top, 0.05).min() == -0.1
        assert WHEELS.motor_torque(np.full((3, 1), -0.1), -top, 0.05).min() == 0.0

    def test_a_wheel_does_not_pass_its_top_speed_in_a_step(self):
        near = np.full((3, 1), WHEELS.top_speed - 1.0)
        torque = WHEELS.motor_torque(np.full((3, 1), 0.1), near, 0.05)
        assert near + torque / WHEELS.spin_inertia * 0.05 == pytest.approx(WHEELS.top_speed)

    def test_friction_acts_against_the_motion(self):
        rubbing = replace(WHEELS, viscous=1e-6, coulomb=1e-4)
        speed = np.array([[100.0], [-100.0], [0.0]])
        torque = rubbing.friction_torque(speed)
        np.testing.assert_allclose(torque[:, 0], [-2e-4, 2e-4, 0.0], rtol=1e-9, atol=0)
        assert rubbing.has_friction
        assert not WHEELS.has_friction

    def test_magnetic_unloading_gives_no_torque_along_the_field(self):
        applied = np.array([0.0, 0.0, 0.0, 1e-3, 2e-3, -1e-3])[:, None]
        field = (np.array([0.0]), np.array([0.6]), np.array([0.8]))
        torque = np.array(WHEELS.unloading_torque(applied, field))[:, 0]
        assert torque @ [0.0, 0.6, 0.8] == pytest.approx(0.0, abs=1e-15)
        assert np.linalg.norm(torque) > 1e-3
        assert np.array(WHEELS.unloading_torque(applied, None))[:, 0] == pytest.approx([1e-3, 2e-3, -1e-3])


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"wheels": ()}, "'wheels' has no wheel"),
        ({"torque": 0.0}, "must be greater than 0"),
        ({"viscous": -1.0}, "must not be negative"),
        ({"wheels": (Wheel("a", (1.0, 0.0, 0.0)),) * 2}, "a name of its own"),
    ],
)
def test_wheels_that_cannot_be_are_refused(change, said):
    with pytest.raises(ValueError, match=said):
        replace(WHEELS, **change)


def test_an_axis_or_an_unloading_of_nothing_is_refused():
    with pytest.raises(ValueError, match="'axis' must not be zero"):
        Wheel("a", (0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match=r"must be greater than 0; without unloading leave it out"):
        Unloading("magnetic", 0.0)


def test_a_satellite_that_asks_to_be_pushed_is_refused():
    with pytest.raises(ValueError, match="reaction_wheels only turn a body"):
        replace(MICROSAT, performance=replace(MICROSAT.performance, force=1.0))
    assert isinstance(WHEELS, ReactionWheels)
