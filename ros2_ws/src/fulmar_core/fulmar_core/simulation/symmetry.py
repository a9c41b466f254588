"""Mirror image of observations and commands: left for right, or front for back.

A robot that is built alike on both sides may answer every observation as it would answer its mirror image, and one
whose two ends are alike as it would if it were turned round. A policy that only ever sees one of the two learns each
turn once, and cannot come to prefer one side or one end.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from fulmar_core.tasks import Task
from fulmar_core.tasks.observation import Observer

Symmetry = Literal["sides", "ends"]

# Terms whose sign says on which side, or at which end, the goal is: negative for the right and for the stern.
SIDES = ("goal_direction_y_in_body", "goal_y_in_body")
ENDS = ("goal_direction_x_in_body", "goal_x_in_body")
_SIDEWAYS = ("_y_in_body", "yaw_rate", "sin_heading_error", "fine_heading_error", "beside_block")
_TURNED = ("_x_in_body", "_y_in_body")


@dataclass(frozen=True)
class Mirror:
    """Matrices that turn rows of terms and of commands into those of the mirror image; each is its own inverse."""

    side: int  # index of the term that is negative where the mirror image is seen
    seen: np.ndarray  # (n, n), for observations
    done: np.ndarray  # (m, m), for shares of full command

    @classmethod
    def of(cls, robot: Robot, task: Task, alike: Symmetry) -> Mirror:
        """The mirror of a robot at a task, which exchanges its sides or its ends.

        Raises:
            ConfigError: The two sides, or ends, of the robot differ, or they do at the task, or its goal lies at none.
        """
        names = Observer(robot, task).names
        signs, flipped = (SIDES, _SIDEWAYS) if alike == "sides" else (ENDS, _TURNED)
        side = next((names.index(name) for name in signs if name in names), None)
        if side is None:
            raise ConfigError(
                f"'mirror': task '{task.name}' has no goal that lies on a side. Leave 'mirror' out."
            )
        if alike == "ends" and any("heading_error" in name for name in names):
            raise ConfigError(
                f"'mirror': at task '{task.name}' it counts which end is ahead. Set 'mirror: sides', or leave it out."
            )
        done = _mirrored_commands(robot) if alike == "sides" else _turned_commands(robot)
        seen = np.diag([-1.0 if any(part in name for part in flipped) else 1.0 for name in names])
        if names[-1].startswith("previous_"):
            count = len(done)
            seen[-count:, -count:] = done
        return cls(side, seen.astype(np.float32), done.astype(np.float32))


def _mirrored_commands(robot: Robot) -> np.ndarray:
    done = robot.actuators.mirrored()
    if done is None:
        raise ConfigError(
            f"'mirror': the two sides of '{robot.name}' are not each other's mirror image, actuator by actuator. "
            "Leave 'mirror' out."
        )
    return done


def _turned_commands(robot: Robot) -> np.ndarray:
    done = robot.actuators.turned()
    if done is None:
        raise ConfigError(
            f"'mirror': '{robot.name}' does not drive astern as it drives ahead; robots on two driven wheels do. "
            "Set 'mirror: sides', or leave it out."
        )
    return done
