"""The process that runs a policy: loads a bundle, refuses a wrong one, answers odometry."""

from __future__ import annotations

import sys
from pathlib import Path

from fulmar_core.controller_settings import ControllerSettings
from fulmar_core.controllers.controller import Controller
from fulmar_core.errors import BundleError
from fulmar_core.robot import Robot
from fulmar_core.tasks import Task
from fulmar_ros.controller_node import ControllerNode
from fulmar_ros.runtime import run_node
from policy_server.policy import Policy
from policy_server.shipped import shipped_policy


def make_policy(robot: Robot, task: Task, settings: ControllerSettings) -> Controller:
    """Load the bundle that the parameters name, or the shipped one for this robot and task."""
    folder = Path(settings.policy) if settings.policy else shipped_policy(robot.name, task.name)
    if folder is None:
        raise BundleError(
            f"no policy is shipped for '{robot.name}' and '{task.name}'. Set the parameter 'policy'."
        )
    trusted = Path(settings.trusted_keys) if settings.trusted_keys else None
    return Policy(folder, robot, task, control_hz=settings.control_rate(robot), trusted=trusted)


def main() -> None:
    """Run the node until it is told to stop."""
    sys.exit(run_node(lambda request_exit: ControllerNode(make_policy, request_exit, learned=True)))


if __name__ == "__main__":
    main()
