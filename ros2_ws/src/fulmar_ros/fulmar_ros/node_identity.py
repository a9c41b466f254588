"""Values by which the status of a plant or controller names its process and what it runs."""

from __future__ import annotations

import os
import socket
from collections.abc import Mapping

from rclpy.lifecycle import LifecycleNode

ROBOT, TASK, CONTROL_HZ, RATE = (
    "robot",
    "task",
    "control_hz",
    "rate",
)  # keys; plant and controller agree on them
STARTED_NS = "started_ns"  # key: differs after each start of a process


def identity_of(
    node: LifecycleNode, *, started_ns: int, robot: str, task: str, control_hz: float, rate: float
) -> dict[str, str]:
    """Full name, host, process and age of a node, and robot, task and rates that it runs.

    Args:
        node: The node.
        started_ns: When it was created, by the wall clock [ns].
        robot: Type of the robot.
        task: Name of the task.
        control_hz: Rate of commands, in the robot's own time [Hz].
        rate: Simulated seconds a wall-clock second.
    """
    return {
        "node": node.get_fully_qualified_name(),
        "host": socket.gethostname(),
        "pid": str(os.getpid()),
        STARTED_NS: str(started_ns),
        **setup_of(robot, task, control_hz, rate),
    }


def setup_of(robot: str, task: str, control_hz: float, rate: float) -> dict[str, str]:
    """What plant and controller of one system have in common; arguments as in `identity_of`."""
    return {ROBOT: robot, TASK: task, CONTROL_HZ: f"{control_hz:g}", RATE: f"{rate:g}"}


def differences(values: Mapping[str, str], setup: Mapping[str, str]) -> list[str]:
    """Differences between the status of a node and a setup, such as `task go_to_pose, here go_to_position`."""
    return [
        f"{key} {values[key]}, here {mine}" for key, mine in setup.items() if values.get(key, mine) != mine
    ]
