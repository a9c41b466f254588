"""The task that a robot is timed at where none is named."""

from __future__ import annotations

from fulmar_core.robots.robot import Robot
from fulmar_core.states.spatial import SpatialState


def usual_task(robot: Robot) -> str:
    """Name of the task: to go to a pose, or of an aircraft, which cannot stop, to hold a height."""
    if robot.flies:
        return "fly_hold"
    return "go_to_pose_3d" if robot.state_type is SpatialState else "go_to_pose"
