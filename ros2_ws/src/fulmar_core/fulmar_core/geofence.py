"""What the geofence limits: how far a robot may be from its goal."""

from __future__ import annotations

from fulmar_core.goal import Goal
from fulmar_core.planar import PlanarState
from fulmar_core.rotation import Array
from fulmar_core.tasks import Task


def distance_from_goal(task: Task, state: PlanarState, goal: Goal) -> Array | None:
    """How far the robot is from the current target; None where goals are no places [m].

    Where something else has to get there, as a block, that is not the task's error alone.
    """
    own = getattr(task, "distance_from_goal", None)
    return task.errors(state, goal).position if own is None else own(state, goal)
