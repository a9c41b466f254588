"""Wheel speeds and inertia that a controller of a satellite takes, and those that it refuses in words."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from geometry_msgs.msg import InertiaStamped
from sensor_msgs.msg import JointState

from fulmar_core.robots.robot_file import load_robot
from fulmar_ros.convert import stamp_of
from fulmar_ros.satellite_inputs import SatelliteInputs

CUBESAT = load_robot("cubesat_wheels")
SECOND = 1_000_000_000


@pytest.fixture
def inputs():
    node = SimpleNamespace(create_subscription=lambda *_given, **_named: None)
    return SatelliteInputs(node, CUBESAT, lambda: None, lockstep=False)


def speeds(value):
    message = JointState(name=list(CUBESAT.actuators.wheel_names), velocity=[value, 0.0, 0.0])
    message.header.stamp = stamp_of(SECOND)
    return message


def inertia(factor):
    message = InertiaStamped()
    message.header.stamp = stamp_of(SECOND)
    its, known = message.inertia, factor * np.diag(CUBESAT.body.inertia_matrix)
    its.ixx, its.iyy, its.izz = known.tolist()
    return message


@pytest.mark.parametrize("value", [4294967295.0, float("nan"), -600.0])
def test_a_wheel_speed_that_no_wheel_has_is_refused_and_the_one_before_stays(inputs, value):
    inputs._take_wheels(speeds(100.0))
    inputs._take_wheels(speeds(value))
    np.testing.assert_array_equal(inputs.readings(SECOND).get("wheels"), [[100.0, 0.0, 0.0]])
    assert inputs.refused == 1
    assert inputs.refusal.startswith("wheel wheel_x reports")
    inputs._take_wheels(speeds(101.0))
    assert inputs.refusal == ""


@pytest.mark.parametrize(
    ("factor", "said"),
    [
        (1e6, "differs from that of the robot's file by a factor of over 5"),
        (-1.0, "that of no body"),
        (float("inf"), "that of no body"),
    ],
)
def test_an_inertia_that_the_robot_cannot_have_is_refused(inputs, factor, said):
    inputs._take_inertia(inertia(1.1))
    inputs._take_inertia(inertia(factor))
    np.testing.assert_allclose(inputs.readings(SECOND).get("inertia"), 1.1 * CUBESAT.body.inertia_matrix)
    assert said in inputs.refusal
