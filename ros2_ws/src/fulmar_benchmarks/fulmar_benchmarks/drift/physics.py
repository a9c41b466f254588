"""What physics allows in each episode of a row that goes to poses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.simulation.episode import episode_steps
from fulmar_evaluation.bounds.approach import approach_bound, can_hold_episodes
from fulmar_evaluation.evaluation import Trial

RADII = {"PT5": 0.05, "PT2": 0.02, "PT1": 0.01}  # [m]


@dataclass(frozen=True)
class Physics:
    """Bounds and feasibility of some episodes."""

    bounds: dict[str, np.ndarray]  # most of PT5, PT2 and PT1, shapes (episodes,) [%]
    can_hold: np.ndarray  # whether the goal's pose can be held there, shape (episodes,)


def physics_of(trial: Trial) -> Physics:
    """Bound and decide every episode of a trial that goes to poses."""
    robot, drawn = trial.robot, trial.drawn(np.arange(trial.episodes))
    dt = robot.timing.substeps(trial.plan.control_hz) * robot.timing.physics_dt
    steps = episode_steps(trial.task, dt)
    bounds = {
        name: approach_bound(robot, drawn, radius=radius, steps=steps, control_dt=dt)
        for name, radius in RADII.items()
    }
    return Physics(bounds, can_hold_episodes(robot, drawn))
