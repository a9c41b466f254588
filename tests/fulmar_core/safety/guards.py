"""Actuators and commands that the tests of the actuator guard share."""

from __future__ import annotations

from fulmar_core.robots.robot_file import load_robot

THRUSTERS = load_robot("floating_platform").actuators
NAMES = THRUSTERS.names
MS = 1_000_000
GOOD = [1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]
BASE = load_robot("turtlebot2").actuators
