"""Odometry whose source says that it does not know a part: a controller that needs it stops, and says why."""

from __future__ import annotations

import pytest
from rclpy.serialization import serialize_message

from fulmar_core.loop.controller_settings import ControllerSettings
from fulmar_core.robots.robot_file import load_robot
from fulmar_ros.convert import OdometryReader, OdometryWriter
from tests.states import planar_state

PARTS = {
    "position": ("pose", 0),
    "attitude": ("pose", 35),
    "velocity": ("twist", 0),
    "turn rate": ("twist", 35),
}
NEEDED = {"floating_platform": set(PARTS), "cubesat_wheels": {"attitude", "turn rate"}}


@pytest.mark.parametrize("robot", NEEDED)
@pytest.mark.parametrize("part", PARTS)
def test_odometry_without_a_part_that_the_robot_needs_is_refused_by_its_name(robot, part):
    message = OdometryWriter(None).write(planar_state(0.0, 0.0, 0.0), 10**9)
    block, index = PARTS[part]
    getattr(message, block).covariance[index] = -1.0
    measurement = OdometryReader().read(bytes(serialize_message(message)))
    said = ControllerSettings(robot=robot).input_gate(load_robot(robot)).problem(measurement)
    if part in NEEDED[robot]:
        assert said.startswith(f"odom has no {part}")
    else:
        assert said is None
