"""The most targets that physics allows a body in space to pass, from the bound in the plane.

The shadow of a path on a plane is a path there: its acceleration is no larger, and it passes the shadows of the
spheres. So whatever is too much in the plane is too much in space, for any plane; the least of several planes counts.
"""

from __future__ import annotations

import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.episode import Episode
from fulmar_core.tasks import Task
from fulmar_evaluation.bounds.time_optimal import time_optimal_bound

PLANES = ((0, 1), (1, 2), (2, 0))  # by their axes in the world


def most_targets(robot: Robot, task: Task, drawn: Episode) -> np.ndarray:
    """Bound the targets of some episodes: time-optimal travel of a point mass, turning not counted.

    Args:
        robot: The robot in space; its nominal body, with the force of its `performance` in every direction.
        task: A task that counts targets; its tolerance is how near counts.
        drawn: The episodes, with their batch axis.

    Returns:
        Whole targets, shape (episodes,).
    """
    start = np.stack((drawn.start.x, drawn.start.y, drawn.start.z), axis=-1)
    places = np.asarray(drawn.goal.targets)[..., :3]
    found = []
    for axes in map(list, PLANES):
        flat, shadows = start[..., axes], places[..., axes]
        if np.any(np.ptp(shadows, axis=1).max(axis=-1) <= 2.0 * task.tolerance.position):
            continue  # the shadows of all targets lie together: this plane has no bound
        bound = time_optimal_bound(
            flat,
            np.zeros(2),
            shadows,
            radius=task.tolerance.position,
            acceleration=robot.performance.force / robot.body.mass,
            duration_s=task.episode_s,
        )
        found.append(bound.goals)
    return np.asarray(np.min(found, axis=0))
