"""Shapes of a robot: its body, what its actuators do, and velocities."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from fulmar_core.robots.actuators.pushing import Pushing
from fulmar_core.robots.actuators.reaction_wheels import ReactionWheels
from fulmar_core.robots.actuators.rolling import Rolling
from fulmar_core.robots.look import Part
from fulmar_core.robots.look_of import hull_of
from fulmar_core.robots.look_primitives import primitives_of
from fulmar_core.robots.robot import Robot
from fulmar_ros.scene.shape import Color, Kind, Shape, arrow, circle, line

BODY, THRUST, DRIVE = "body", "thrust", "drive"
KINDS: dict[str, Kind] = {"box": "box", "cylinder": "cylinder", "sphere": "sphere", "mesh": "mesh"}
GREY: Color = (0.6, 0.6, 0.65, 0.35)  # the model of `robot_description` shows through
FLAME: Color = (1.0, 0.5, 0.1, 0.9)
WATER: Color = (0.2, 0.7, 0.9, 0.9)
YELLOW: Color = (0.95, 0.85, 0.1, 1.0)
LEAST = 0.02  # share of full command below which nothing is drawn
AHEAD_S = 1.0  # a velocity is drawn as what it goes in this time [s]


def body_shapes(robot: Robot) -> list[Shape]:
    """The robot's look, in the primitives that viewers draw; without one its outline, faint, beside the URDF's."""
    if robot.look:
        return [_shape_of(number, part, part.rgba) for number, part in enumerate(primitives_of(robot.look))]
    return [_shape_of(number, part, GREY) for number, part in enumerate(hull_of(robot))]


def _shape_of(number: int, part: Part, color: Color) -> Shape:
    """A box, a cylinder, a sphere or a mesh on the body."""
    if part.shape == "mesh":
        kind, scale = KINDS[part.shape], part.scale
        return Shape(BODY, number, kind, True, scale, color, part.at, quat=part.quat_xyzw, file=part.file)
    x, y, z = (
        (part.size[0], *part.size) if part.shape == "cylinder" else (*part.size, *part.size, *part.size)[:3]
    )
    return Shape(BODY, number, KINDS[part.shape], True, (x, y, z), color, part.at, quat=part.quat_xyzw)


def plumes(robot: Robot, actuators: Pushing, effort: Sequence[float]) -> list[Shape]:
    """What leaves a nozzle, a propeller or a fan: against its push, at full thrust as long as the body's radius."""
    shares = np.asarray(actuators.thrusts(np.asarray(effort, dtype=float))) / actuators.full_thrust
    color = WATER if robot.hydrodynamics is not None else FLAME
    shapes = []
    for number, (push, share) in enumerate(zip(actuators.pushes, shares.tolist(), strict=True)):
        if abs(share) < LEAST:
            continue
        reach = robot.body.radius * share
        tip = [p - reach * d for p, d in zip(push.position, push.direction, strict=True)]
        shapes.append(arrow(THRUST, number, push.position, tip, color, in_body=True))
    return shapes


def torques(robot: Robot, wheels: ReactionWheels, effort: Sequence[float]) -> list[Shape]:
    """Torque of each actuator on the body, along its axis: at full torque as long as the body's radius."""
    shares = np.asarray(effort, dtype=float) / wheels.scale
    tips = robot.body.radius * shares[:, None] * wheels.torque_per_command
    origin = (0.0, 0.0, 0.0)
    return [
        arrow(THRUST, number, origin, tip.tolist(), YELLOW, in_body=True)
        for number, tip in enumerate(tips)
        if np.linalg.norm(tip) >= LEAST * robot.body.radius
    ]


def drive(robot: Robot, wheels: Rolling, effort: Sequence[float]) -> list[Shape]:
    """Where wheels drive to."""
    speed, turn = effort
    return velocity_shapes(DRIVE, (speed, 0.0, 0.0, 0.0, 0.0, wheels.turn_rate(speed, turn)), robot, YELLOW)


def velocity_shapes(group: str, twist: Sequence[float], robot: Robot, color: Color) -> list[Shape]:
    """A velocity as an arrow, and a turn rate as an arc around the body or, in space, as an arrow along its axis.

    Args:
        group: Of the shapes.
        twist: Velocity [m/s] and turn rate [rad/s] along the body's axes, six numbers.
        robot: Arcs go around its body.
        color: Of both.
    """
    above = 0.0 if robot.state_type.AXES == 3 else robot.hull_span[1]
    origin = (0.0, 0.0, above)
    velocity = [AHEAD_S * part for part in twist[:3]]
    rate = [AHEAD_S * part for part in twist[3:]]
    shapes = []
    if math.hypot(*velocity) >= LEAST:
        tip = [start + way for start, way in zip(origin, velocity, strict=True)]
        shapes.append(arrow(group, 0, origin, tip, color, in_body=True))
    if math.hypot(*rate) >= LEAST:
        if robot.state_type.AXES == 3:
            shapes.append(arrow(group, 1, origin, rate, color, in_body=True))
        else:
            shapes.append(
                line(group, 1, circle(origin, robot.body.radius, turn=rate[2]), color, in_body=True)
            )
    return shapes
