"""How many waypoints a robot reaches, against what physics allows it: the bound of its family, episode by episode."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fulmar_core.actuators.thrusters import Thrusters
from fulmar_core.bounds import time_optimal_bound, top_speed_bound
from fulmar_core.episode import Episode
from fulmar_core.robot import Robot
from fulmar_core.tasks import Task

# Tasks whose targets are passed within a radius, in a loop.
BOUNDED = ("go_through_positions", "go_through_poses", "race_waypoints", "race_wayposes")


@dataclass(frozen=True)
class WaypointBound:
    """The most waypoints that a robot can reach, and what that is made of."""

    goals: np.ndarray  # (episodes,) whole waypoints
    rule: str  # in words


def waypoint_bound(robot: Robot, task: Task, drawn: Episode, duration_s: float) -> WaypointBound | None:
    """Bound the waypoints of some episodes.

    A robot with thrusters gets the time-optimal bound of a point mass: its force in the strongest direction over its
    nominal mass, whichever way it faces, and no time for turning. Any other gets the bound at its top speed: no time
    for speeding up, for turning, or for slew. Pushes and other masses of a scenario are not in it.

    Args:
        robot: The robot.
        task: The task; its tolerance is how near counts.
        drawn: The episodes, with their batch axis.
        duration_s: How long they last [s].

    Returns:
        The bound; None for tasks that do not count waypoints.
    """
    if task.kind not in BOUNDED:
        return None
    start = np.stack((drawn.start.x, drawn.start.y), axis=-1)
    places, radius = np.asarray(drawn.goal.targets)[..., :2], task.tolerance.position
    if isinstance(robot.actuators, Thrusters):
        acceleration = robot.performance.force / robot.body.mass
        velocity = np.stack((drawn.start.vx, drawn.start.vy), axis=-1)
        bound = time_optimal_bound(
            start,
            velocity,
            places,
            radius=radius,
            acceleration=acceleration,
            top_speed=math.inf,
            duration_s=duration_s,
        )
        return WaypointBound(bound.goals, f"time-optimal at {acceleration:.3f} m/s², turning not counted")
    speed = robot.performance.top_speed
    bound = top_speed_bound(start, places, radius=radius, top_speed=speed, duration_s=duration_s)
    return WaypointBound(bound.goals, f"at the top speed of {speed:g} m/s, slew and turning not counted")


def shares_of_bound(goals: np.ndarray, bound: np.ndarray) -> np.ndarray:
    """Waypoints reached as shares of the bound, shape (episodes,); NaN where not even one can be reached [-]."""
    return np.where(bound > 0, goals / np.maximum(bound, 1), np.nan)
