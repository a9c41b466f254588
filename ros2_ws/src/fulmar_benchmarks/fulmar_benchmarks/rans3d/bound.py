"""The most targets that physics allows a body in space to pass, from the bound in the plane.

The shadow of a path on a plane is a path there: its acceleration is no larger, and it passes the shadows of the
spheres. So whatever is too much in the plane is too much in space, for any plane; the least of several planes counts.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from fulmar_benchmarks.rans3d.unit import SpaceTrial
from fulmar_benchmarks.shape import Cell, Figures, Progress
from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.episode import Episode
from fulmar_core.tasks import Task
from fulmar_evaluation.bounds.time_optimal import time_optimal_bound

PLANES = ((0, 1), (1, 2), (2, 0))  # by their axes in the world
BOUNDED = 64  # episodes, from the first on: each takes a tenth of a second


@dataclass(frozen=True)
class BoundCell(Cell):
    """Bound on the first `BOUNDED` episodes of a trial."""

    modules = ("fulmar_benchmarks.rans3d.unit",)
    trial: SpaceTrial

    @property
    def name(self) -> str:
        """File name without suffix."""
        return f"bound_{self.trial.plan.robot}_{self.trial.plan.task}"

    @property
    def numbers(self) -> np.ndarray:
        """Of the episodes."""
        return np.arange(min(self.trial.episodes, BOUNDED))

    @property
    def cost(self) -> float:
        """In steps of a batch."""
        return 5e4 * len(self.numbers)

    def parts(self) -> dict[str, Any]:
        """Whoever drives."""
        plan = asdict(replace(self.trial.plan, policy="", controller=""))
        return {"plan": plan, "farthest_m": self.trial.farthest_m, "episodes": len(self.numbers)}

    def measure(self, progress: Progress, pool: Any = None) -> Figures:
        """Whole targets of each episode."""
        return {"goals": most_targets(self.trial.robot, self.trial.task, self.trial.drawn(self.numbers))}


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
