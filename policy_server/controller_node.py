"""The process that controls a robot: loads the controller that its parameter names, and answers odometry."""

from __future__ import annotations

import sys

from fulmar_core.controllers.controller import Controller
from fulmar_core.loop.controller_settings import ControllerSettings
from fulmar_core.robots.robot import Robot
from fulmar_core.tasks import Task
from fulmar_ros.controller_node import ControllerNode
from fulmar_ros.runtime import run_node
from policy_server.controllers import Choice, load_controller


def make_controller(robot: Robot, task: Task, settings: ControllerSettings) -> Controller:
    """Load the controller that the parameters of a node name."""
    choice = Choice(
        settings.control_rate(robot),
        settings.policy,
        settings.trusted_keys,
        settings.excitation,
        settings.seed,
    )
    return load_controller(settings.controller, robot, task, choice)


def main() -> None:
    """Run the node until it is stopped."""
    sys.exit(run_node(lambda request_exit: ControllerNode(make_controller, request_exit)))


if __name__ == "__main__":
    main()
