"""How many waypoints a robot reaches, against what physics allows it: the bound of its family, episode by episode."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_core.simulation.episode import Episode
from fulmar_core.tasks import Task
from fulmar_evaluation.bounds import bound_of, top_speed_bound

# Tasks whose targets are passed within a radius, in a loop.
BOUNDED = ("go_through_positions", "go_through_poses", "race_waypoints", "race_wayposes")


@dataclass(frozen=True)
class WaypointBound:
    """The most waypoints that a robot can reach, and what that is made of."""

    goals: np.ndarray  # (episodes,) whole waypoints, by the bound that fits the robot
    # (episodes,) if nothing but its top speed held it; None: it has none
    goals_at_top_speed: np.ndarray | None
    name: str  # time_optimal, turn_limited or top_speed
    rule: str  # the same in words


def has_bound(task: Task) -> bool:
    """Whether waypoints of a task can be bounded."""
    return task.kind in BOUNDED


def waypoint_bound(robot: Robot, task: Task, drawn: Episode, duration_s: float) -> WaypointBound:
    """Bound the waypoints of some episodes; `bounds.bound_of` says what is in the bound.

    Args:
        robot: The robot; its body is the nominal one, in a still world.
        task: One that `has_bound`; its tolerance is how near counts.
        drawn: The episodes, with their batch axis.
        duration_s: How long they last [s].
    """
    start = np.stack((drawn.start.x, drawn.start.y), axis=-1)
    places, radius = np.asarray(drawn.goal.targets)[..., :2], task.tolerance.position
    found = bound_of(
        robot,
        start,
        places,
        radius,
        duration_s,
        start_yaw=np.asarray(drawn.start.yaw),
        start_velocity=np.stack((drawn.start.vx, drawn.start.vy), axis=-1),
    )
    fastest = None
    if found.name != "time_optimal":
        speed = robot.performance.top_speed
        fastest = top_speed_bound(start, places, radius=radius, top_speed=speed, duration_s=duration_s).goals
    return WaypointBound(found.bound.goals, fastest, found.name, found.rule)


def bound_figures(goals: np.ndarray, bound: WaypointBound) -> dict[str, np.ndarray]:
    """Figures of episodes against their bound.

    Args:
        goals: Waypoints reached, shape (episodes,).
        bound: Of the first episodes, perhaps of all.

    Returns:
        Figures by name, shapes (episodes,); NaN beyond the episodes that were bounded.
    """
    figures = {"goals_bound": bound.goals, "share_of_bound": _shares(goals, bound.goals)}
    if bound.goals_at_top_speed is not None:
        figures["goals_at_top_speed"] = bound.goals_at_top_speed
        figures["share_at_top_speed"] = _shares(goals, bound.goals_at_top_speed)
    missing = len(goals) - len(bound.goals)
    return {name: np.append(values, np.full(missing, np.nan)) for name, values in figures.items()}


def _shares(goals: np.ndarray, bound: np.ndarray) -> np.ndarray:
    """Goals over their bound; NaN where not even one can be reached."""
    return np.where(bound > 0, goals[: len(bound)] / np.maximum(bound, 1), np.nan)
