"""How late a robot answers, as far as its file or its calibration says."""

from __future__ import annotations

from fulmar_core.robots.robot import Robot


def known_delay_s(robot: Robot) -> float:
    """From a command to its effect in the odometry [s]."""
    response = robot.actuators.response
    return robot.sensors.odometry.delay_s + response.latest_s + response.lag_s
