"""Coverage of the episodes of an evaluation, and of a recorded run."""

from __future__ import annotations

import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.trajectories import Trajectories
from fulmar_core.tasks import Task
from fulmar_evaluation.coverage.coverage import EVERY_S, coverage

EPISODES = 64  # of which it is computed: a fifth of a second each


def with_coverage(
    figures: dict[str, np.ndarray], run: Trajectories, robot: Robot, task: Task, *, most: int = EPISODES
) -> dict[str, np.ndarray]:
    """Figures of `metrics.episode_metrics` with `coverage` filled in, and `coverage_possible` beside it.

    Args:
        figures: Those without `coverage` stay as they are, as do those of a robot without a camera.
        run: What happened.
        robot: Its camera looks.
        task: The first thing of its world is looked at.
        most: Episodes from the first on for which it is computed; the others have none.
    """
    camera, quat = robot.sensors.camera, (run.qx, run.qy, run.qz, run.qw)
    if "coverage" not in figures or camera is None or any(part is None for part in quat):
        return figures
    step = max(1, round(EVERY_S / run.control_dt))
    columns = [np.asarray(column, dtype=float)[:, ::step] for column in (run.x, run.y, run.z, *quat)]
    poses = np.stack(columns, axis=-1)  # (episodes, times, 7)
    poses[..., 3:] /= np.linalg.norm(poses[..., 3:], axis=-1, keepdims=True)
    seen, possible = np.full((2, len(poses)), np.nan)
    for episode in range(min(most, len(poses))):
        found = coverage(task.structures[0], poses[episode], camera)
        seen[episode], possible[episode] = found.share, found.visible
    return figures | {"coverage": seen, "coverage_possible": possible}
