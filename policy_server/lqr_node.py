"""The process that runs the LQR: same node, same wires as a policy."""

from __future__ import annotations

import sys

from fulmar_core.controller_settings import ControllerSettings
from fulmar_core.controllers.classical import load_lqr
from fulmar_core.controllers.controller import Controller
from fulmar_core.robot import Robot
from fulmar_core.tasks import Task
from fulmar_ros.controller_node import ControllerNode
from fulmar_ros.runtime import run_node


def make_lqr(robot: Robot, task: Task, settings: ControllerSettings) -> Controller:
    """Solve for the gain with the robot's weights."""
    return load_lqr(robot, task, control_hz=settings.control_rate(robot))


def main() -> None:
    """Run the node until it is told to stop."""
    sys.exit(run_node(lambda request_exit: ControllerNode(make_lqr, request_exit)))


if __name__ == "__main__":
    main()
