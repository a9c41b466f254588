"""Which episodes have a goal pose that can be held."""

from __future__ import annotations

import numpy as np

from fulmar_core.disturbances.world import outside_wrench
from fulmar_core.episode import Episode
from fulmar_core.holdability import LEAST_MARGIN, hold_margin
from fulmar_core.planar import at_rest
from fulmar_core.robot import Robot


def can_hold_episodes(robot: Robot, drawn: Episode) -> np.ndarray:
    """Whether the goal pose of each episode can be held in its own world.

    Args:
        robot: A planar robot with thrusters.
        drawn: Episodes whose goals have a heading, as `draw_episodes` gives them.

    Returns:
        Truth values, shape (episodes,).

    Raises:
        ConfigError: The robot has no thrusters.
    """
    goal = np.asarray(drawn.goal.current, dtype=float)
    there = at_rest(goal[:, 0], goal[:, 1], goal[:, 2])
    # At the beginning nothing kicks; kicks come and go, and no pose is lost for them.
    fx, fy, torque = outside_wrench(there, drawn.world, np.zeros(len(goal)), robot.timing.physics_dt)
    working = (drawn.world.alive * drawn.world.gain).T
    known: dict[bytes, bool] = {}  # most episodes of a condition differ in the lost valves alone
    able = np.zeros(len(goal), dtype=bool)
    for i in range(len(goal)):
        force = np.array([fx[i], fy[i]])
        told = np.array([*working[i], *force, torque[i], goal[i, 2] if force.any() else 0.0])
        key = told.tobytes()
        if key not in known:
            known[key] = (
                hold_margin(robot, working[i], force, float(torque[i]), float(goal[i, 2])) > LEAST_MARGIN
            )
        able[i] = known[key]
    return able
