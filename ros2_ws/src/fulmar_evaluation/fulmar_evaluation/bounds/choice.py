"""Which bound fits which robot."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_evaluation.bounds.by_kind import motions_of
from fulmar_evaluation.bounds.time_optimal import time_optimal_bound
from fulmar_evaluation.bounds.top_speed import top_speed_bound
from fulmar_evaluation.bounds.turn_limited import turn_limited_bound
from fulmar_evaluation.bounds.visits import Bound


@dataclass(frozen=True, slots=True)
class NamedBound:
    """A bound, and what it counts."""

    bound: Bound
    name: str  # time_optimal, turn_limited or top_speed
    rule: str  # in words


def bound_of(
    robot: Robot,
    start_xy: np.ndarray,
    waypoints: np.ndarray,
    radius: float,
    duration_s: float,
    *,
    start_yaw: np.ndarray | None = None,
    start_velocity: np.ndarray | None = None,
) -> NamedBound:
    """Most waypoints that a robot can visit in a loop, by what limits its family.

    What pushes to every side: time-optimal travel of a point mass with the force in the strongest direction, whichever
    way it faces. Propellers in water and wheels: travel along the heading at the speeds and turn rates that the robot
    can hold, with the time that starting and stopping take. Any other: travel at top speed. The body is the nominal
    one, in a still world.

    Args:
        robot: The robot.
        start_xy: Where episodes start, shape (..., 2) [m].
        waypoints: Shape (..., K, 2) [m].
        radius: How near a visit is [m].
        duration_s: Length of an episode [s].
        start_yaw: Heading at the start, shape (...,); any by default [rad].
        start_velocity: In the world, shape (..., 2), where actuators push to every side; at rest by default [m/s].

    Returns:
        The bound with its name.

    Raises:
        ValueError: Something is not positive, or the number has no bound.
    """
    if robot.actuators.sideways:
        acceleration = robot.performance.force / robot.body.mass
        bound = time_optimal_bound(
            start_xy,
            np.zeros(2) if start_velocity is None else start_velocity,
            waypoints,
            radius=radius,
            acceleration=acceleration,
            top_speed=math.inf,
            duration_s=duration_s,
        )
        return NamedBound(
            bound, "time_optimal", f"time-optimal at {acceleration:.3f} m/s², turning not counted"
        )
    motions = motions_of(robot)
    if motions is not None:
        bound = turn_limited_bound(
            start_xy, waypoints, motions=motions, radius=radius, duration_s=duration_s, start_yaw=start_yaw
        )
        fastest = max(rate for _, rate in motions.turns)
        rule = (
            f"at up to {motions.ahead:.2f} m/s and {fastest:.2f} rad/s, inertia and slew in turns not counted"
        )
        return NamedBound(bound, "turn_limited", rule)
    speed = robot.performance.top_speed
    bound = top_speed_bound(start_xy, waypoints, radius=radius, top_speed=speed, duration_s=duration_s)
    return NamedBound(bound, "top_speed", f"at the top speed of {speed:g} m/s, slew and turning not counted")
