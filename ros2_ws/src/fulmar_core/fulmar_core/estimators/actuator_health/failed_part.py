"""What is found of a part of a robot whose feedback does not fit its commands."""

from __future__ import annotations

from dataclasses import dataclass

from fulmar_core.robots.robot import Robot


@dataclass(frozen=True, slots=True)
class Finding:
    """One part that does not do what is applied to it.

    Attributes:
        part: Its name, see `MovingParts.names`; empty where no single part can be named.
        words: A sentence for people, without numbers that change from step to step.
        value: Where it stands, in the unit of its command; None where that is not known.
    """

    part: str
    words: str
    value: float | None = None


def dead(part: str) -> Finding:
    """A part that gives nothing."""
    return Finding(part, f"{part} does not follow its command: it is dead")


def stuck(part: str, value: float, unit: str) -> Finding:
    """A part that stands at a value, whatever it is commanded."""
    return Finding(
        part, f"{part} is stuck at {value:+.2f}{unit and ' ' + unit}, whatever it is commanded", value
    )


def unresponsive(part: str) -> Finding:
    """A part that does not do what it is commanded, and of which nothing is measured but what it does to the robot."""
    return Finding(part, f"{part} does not follow its command: it is dead, lost or stuck")


def standard_deviations(robot: Robot) -> tuple[float, float]:
    """Noise of the odometry's velocity [m/s] and turn rate [rad/s]; at least what a model errs by."""
    odometry = robot.sensors.odometry
    return max(odometry.velocity.std, LEAST_SPEED), max(odometry.yaw_rate.std, LEAST_RATE)


LEAST_SPEED, LEAST_RATE = 0.005, 0.005  # of velocities that are reported without noise [m/s, rad/s]
