"""States that tests begin from."""

from __future__ import annotations

import numpy as np

from fulmar_core.states.planar import PlanarState
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks import Task
from fulmar_core.tasks.goal import Goal


def planar_state(
    x: float, y: float, yaw: float, *, vx: float = 0.0, vy: float = 0.0, yaw_rate: float = 0.0
) -> RigidBodyState:
    """State of one body in the plane z = 0; units as in `PlanarState`."""
    return PlanarState(
        *(np.asarray(value, dtype=float) for value in (x, y, yaw, vx, vy, yaw_rate))
    ).to_rigid()


def received_targets(goal: Goal, task: Task) -> np.ndarray:
    """Targets of a goal as they are received: poses, shape (k, 7), or twists, shape (k, 6)."""
    return task.state_type.rigid_targets(np.asarray(goal.targets), twists=task.goal_topic == "goal_velocity")
