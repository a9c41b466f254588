"""What robots of families that move along their heading can hold, by the family of their actuators."""

from __future__ import annotations

from collections.abc import Callable

from fulmar_core.robots.robot import Robot
from fulmar_evaluation.bounds.motions import Motions, in_water, on_steered_wheels, on_two_wheels

MOTIONS: dict[str, Callable[..., Motions | None]] = {
    "propellers": in_water,
    "differential_drive": on_two_wheels,
    "ackermann": on_steered_wheels,
}


def motions_of(robot: Robot) -> Motions | None:
    """Steady speeds and turn rates; None for robots that move in all directions, or that nothing in the water slows."""
    made = MOTIONS.get(robot.actuators.kind)
    return made(robot, robot.actuators) if made else None
