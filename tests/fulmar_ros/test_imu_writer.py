"""Inertial readings as messages."""

from __future__ import annotations

import numpy as np
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Imu

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.imu import ImuSample
from fulmar_core.robots.sensors.table import SENSORS
from fulmar_core.wires.reading import Reading
from fulmar_ros.sensor_wires import ReadingWriter

TURN = np.array([0.0, 0.0, 0.3])


def written(force):
    writer = ReadingWriter(SENSORS["imu"], load_robot("turtlebot2").sensors.imu)
    return deserialize_message(writer.write(Reading(ImuSample(force, TURN)), 1), Imu)


def test_a_force_that_nobody_measures_is_marked_as_absent():
    message = written(np.full(3, np.nan))
    assert message.linear_acceleration_covariance[0] == -1.0
    assert message.linear_acceleration.z == 0.0
    assert message.angular_velocity.z == 0.3


def test_a_force_that_is_measured_has_its_noise():
    message = written(np.array([0.0, 0.0, 9.81]))
    assert message.linear_acceleration_covariance[0] > 0.0
    assert message.linear_acceleration.z == 9.81
