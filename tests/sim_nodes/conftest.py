"""Episodes for simulators, without a task."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.simulation.episode import Episode, draw_episode
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks.goal import goal_at
from fulmar_core.worlds.scenario import load_scenario
from tests.spaces import task_for


@pytest.fixture(scope="session")
def episode():
    """Builds an episode: place and motion of the start, obstacles, things, and numbers of the world by name.

    A start has the columns of the robot's own state, or for any robot those of one in the plane.
    """
    ideal = load_scenario("ideal")

    def build(robot, *, start=(0.0,) * 6, obstacles=None, things=None, **world):
        kind, task = robot.state_type, task_for(robot, "go_to_pose")
        own = kind if len(start) == len(kind.COLUMNS) else PlanarState
        begun = own(*(np.asarray(float(value)) for value in start))
        goal = goal_at(kind.target_at((0.0,) * kind.AXES), obstacles=obstacles)
        return Episode(
            begun if own is kind else kind.from_rigid(begun.to_rigid()),
            goal.among({name: np.array(pose) for name, pose in (things or {}).items()}),
            replace(
                draw_episode(robot, task, ideal, seed=0, number=0).world,
                **{name: np.asarray(value, dtype=float) for name, value in world.items()},
            ),
        )

    return build
