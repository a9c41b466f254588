"""What controller nodes in the process of a test load, whatever their parameter `controller` says."""

from __future__ import annotations

from fulmar_core.controller_settings import ControllerSettings
from fulmar_core.controllers.classical import load_classical
from fulmar_core.controllers.law import Law
from fulmar_core.robot import Robot
from fulmar_core.tasks import Task


def make_lqr(robot: Robot, task: Task, settings: ControllerSettings) -> Law:
    """The LQR with the robot's weights."""
    return load_classical(robot, task, control_hz=settings.control_rate(robot), law="lqr")


def make_classical(robot: Robot, task: Task, settings: ControllerSettings) -> Law:
    """The law of the robot's family with its gains."""
    return load_classical(robot, task, control_hz=settings.control_rate(robot))
