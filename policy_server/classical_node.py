"""The process that runs the classical law of a robot's family: same node, same wires as a policy."""

from __future__ import annotations

import sys

from fulmar_core.controller_settings import ControllerSettings
from fulmar_core.controllers.classical import load_classical
from fulmar_core.controllers.controller import Controller
from fulmar_core.robot import Robot
from fulmar_core.tasks import Task
from fulmar_ros.controller_node import ControllerNode
from fulmar_ros.runtime import run_node


def make_classical(robot: Robot, task: Task, settings: ControllerSettings) -> Controller:
    """The law for the robot and the task, with the robot's gains."""
    return load_classical(robot, task, control_hz=settings.control_rate(robot))


def main() -> None:
    """Run the node until it is told to stop."""
    sys.exit(run_node(lambda request_exit: ControllerNode(make_classical, request_exit)))


if __name__ == "__main__":
    main()
