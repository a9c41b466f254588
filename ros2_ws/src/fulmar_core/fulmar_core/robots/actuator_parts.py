"""The actuators of a robot as people see them: kind, place, direction and full command, in the order of commands."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

from fulmar_core.robots.actuators.control_surfaces import ControlSurfaces, is_throttle
from fulmar_core.robots.actuators.pushing import Pushing
from fulmar_core.robots.robot import Robot

KINDS = (
    "nozzle",
    "propeller",
    "fan",
    "wheel",
    "reaction_wheel",
    "surface",
    "throttle",
    "drive",
    "steer",
    "other",
)
Vector3 = tuple[float, float, float]
MIDDLE: Vector3 = (0.0, 0.0, 0.0)
AHEAD: Vector3 = (1.0, 0.0, 0.0)
UP: Vector3 = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class ActuatorPart:
    """One actuator of a robot.

    Attributes:
        name: As in commands.
        kind: One of `KINDS`.
        position: Where it is in the body's frame; the middle where the robot's file does not say [m].
        direction: Of the push on the body by a positive command, or of the axis that it turns about, a unit vector.
        full: Largest command, in `unit`.
        low: Smallest command, in `unit`.
        unit: Of commands.
    """

    name: str
    kind: str
    position: Vector3
    direction: Vector3
    full: float
    low: float
    unit: str


def actuator_parts(robot: Robot) -> tuple[ActuatorPart, ...]:
    """Every actuator of a robot, in the order of its commands."""
    actuators = robot.actuators
    rows = zip(
        actuators.names, actuators.units, actuators.scale.tolist(), actuators.lowest.tolist(), strict=True
    )
    return tuple(
        ActuatorPart(name, *_seen(robot, name, number), full, low, unit)
        for number, (name, unit, full, low) in enumerate(rows)
    )


def actuators_as_json(robot: Robot) -> list[dict[str, Any]]:
    """`actuator_parts` as values that JSON has."""
    return [{**asdict(part), "position": list(part.position), "direction": list(part.direction)}
            for part in actuator_parts(robot)]  # fmt: skip


Seen = tuple[str, Vector3, Vector3]  # kind, position and direction of an actuator


def _seen(robot: Robot, name: str, number: int) -> Seen:
    """That of the actuator of a name, which has this number in commands."""
    return SEEN.get(robot.actuators.kind, _pusher)(robot, name, number)


def _pusher(robot: Robot, _name: str, number: int) -> Seen:
    actuators = robot.actuated_by(Pushing)
    push = actuators.pushes[number]
    return PUSHERS.get(actuators.kind, "nozzle"), push.position, push.direction


def _reaction_wheel(robot: Robot, name: str, _number: int) -> Seen:
    axes = {fixture.name: fixture for fixture in robot.actuators.fixtures}
    axis = axes[name].axis if name in axes else None
    if axis is None:
        return "other", MIDDLE, MIDDLE  # a torque from outside, which no part of the body shows
    x, y, z = axis
    return "reaction_wheel", axes[name].position, (x, y, z)


def _surface(robot: Robot, name: str, _number: int) -> Seen:
    motors = {motor.name: motor.position for motor in robot.actuated_by(ControlSurfaces).motors}
    if name in motors or is_throttle(name):
        return "throttle", motors.get(name, MIDDLE), AHEAD
    return "surface", MIDDLE, MIDDLE


def _drive(turns: str) -> Callable[[Robot, str, int], Seen]:
    return lambda _robot, _name, number: (turns, MIDDLE, UP) if number else ("drive", MIDDLE, AHEAD)


PUSHERS = {"propellers": "propeller", "fans": "fan"}
SEEN: dict[str, Callable[[Robot, str, int], Seen]] = {
    "reaction_wheels": _reaction_wheel,
    "control_surfaces": _surface,
    "differential_drive": _drive("wheel"),
    "ackermann": _drive("steer"),
}
