"""The mirror image of what a robot sees and does: left for right.

A robot that is built alike on both sides may answer every situation as it would answer its mirror image. A policy that
only ever sees one of the two learns each turn once, and cannot come to prefer one side.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.actuators.ackermann import Ackermann
from fulmar_core.actuators.differential_drive import DifferentialDrive
from fulmar_core.actuators.propellers import Propellers
from fulmar_core.errors import ConfigError
from fulmar_core.observation import Observer
from fulmar_core.robot import Robot
from fulmar_core.tasks import Task

SIDES = (
    "goal_direction_y_in_body",
    "goal_y_in_body",
)  # negative: the goal is on the right, which is mirrored
_SIDEWAYS = ("_y_in_body", "yaw_rate", "sin_heading_error", "fine_heading_error", "beside_block")


@dataclass(frozen=True)
class Mirror:
    """Matrices that turn rows of terms and of commands into those of the mirror image; each is its own inverse."""

    side: int  # index of the term whose sign says on which side the goal is
    seen: np.ndarray  # (n, n), for observations
    done: np.ndarray  # (m, m), for shares of full command

    @classmethod
    def of(cls, robot: Robot, task: Task) -> Mirror:
        """The mirror of a robot at a task.

        Raises:
            ConfigError: The two sides of the robot differ, or the task has no goal that lies on a side.
        """
        names = Observer(robot, task).names
        side = next((names.index(name) for name in SIDES if name in names), None)
        if side is None:
            raise ConfigError(
                f"'mirror': task '{task.name}' has no goal that lies on a side. Leave 'mirror' out."
            )
        done = _mirrored_commands(robot)
        seen = np.diag([-1.0 if _is_sideways(name) else 1.0 for name in names])
        if names[-1].startswith("previous_"):
            count = len(done)
            seen[-count:, -count:] = done
        return cls(side, seen.astype(np.float32), done.astype(np.float32))


def _is_sideways(name: str) -> bool:
    return any(part in name for part in _SIDEWAYS)


def _mirrored_commands(robot: Robot) -> np.ndarray:
    actuators = robot.actuators
    if isinstance(actuators, DifferentialDrive | Ackermann):
        return np.diag([1.0, -1.0])
    if isinstance(actuators, Propellers):
        places = [tuple(propeller.position) for propeller in actuators.propellers]
        others = [(x, -y, z) for x, y, z in places]
        if set(places) == set(others):
            return np.eye(len(places))[[places.index(other) for other in others]]
    raise ConfigError(
        f"'mirror': the two sides of '{robot.name}' are not each other's mirror image, actuator by actuator. "
        "Leave 'mirror' out."
    )
