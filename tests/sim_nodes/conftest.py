"""Episodes for simulators, without a task."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.disturbances.scenario import load_scenario
from fulmar_core.episode import Episode, draw_episode
from fulmar_core.goal import goal_at
from fulmar_core.planar import PlanarState
from fulmar_core.tasks import load_task


@pytest.fixture(scope="session")
def episode():
    """Builds an episode: place and motion of the start, obstacles, things, and numbers of the world by name."""
    task, ideal = load_task("go_to_pose"), load_scenario("ideal")

    def build(robot, *, start=(0.0,) * 6, obstacles=None, things=None, **world):
        goal = goal_at((0.0, 0.0, 0.0), obstacles=obstacles)
        return Episode(
            PlanarState(*(np.asarray(float(value)) for value in start)),
            goal.among({name: np.array(pose) for name, pose in (things or {}).items()}),
            replace(
                draw_episode(robot, task, ideal, seed=0, number=0).world,
                **{name: np.asarray(value, dtype=float) for name, value in world.items()},
            ),
        )

    return build
