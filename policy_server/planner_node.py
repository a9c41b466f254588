"""The process that runs a planner: same node, same wires as a policy."""

from __future__ import annotations

import sys

from fulmar_core.controller_settings import ControllerSettings
from fulmar_core.controllers.controller import Controller
from fulmar_core.robot import Robot
from fulmar_core.tasks import Task
from fulmar_ros.controller_node import ControllerNode
from fulmar_ros.runtime import run_node
from policy_server.planning.loading import check_planner, planner_with
from policy_server.policy_node import make_policy


def make_planner(robot: Robot, task: Task, settings: ControllerSettings) -> Controller:
    """Load the bundle as the policy's node does, and get ready to plan with it."""
    check_planner(robot, task)
    planner = planner_with(robot, task, lambda: make_policy(robot, task, settings), patient=settings.lockstep)
    planner.warm_up()
    return planner


def main() -> None:
    """Run the node until it is told to stop."""
    sys.exit(run_node(lambda request_exit: ControllerNode(make_planner, request_exit)))


if __name__ == "__main__":
    main()
