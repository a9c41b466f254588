"""What to measure of a new robot, with which command."""

from __future__ import annotations

from fulmar_core.robots.robot import Robot
from fulmar_evaluation.new_robot.by_kind import RULES


def measuring_steps(robot: Robot) -> tuple[str, ...]:
    """One line for each step, in their order."""
    name = robot.name
    return (
        f"fulmar check robot {name}: what its actuators can do, and what looks like a mistake",
        "a scale: body.mass; a ruler: body.radius, body.height, places of actuators and sensors",
        *RULES[robot.kind.name].identify(robot),
        "fulmar commission HARDWARE --yes: which wire drives what; HARDWARE as in docs/own-driver.md",
    )
