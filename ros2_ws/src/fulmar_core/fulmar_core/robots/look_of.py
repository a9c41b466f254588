"""The look of a robot: that of its file, or its hull and its nozzles."""

from __future__ import annotations

import math
from typing import Any

from fulmar_core.robots.look import Part
from fulmar_core.robots.look_primitives import boxed
from fulmar_core.robots.mesh_outline import outline_of, packed, share_of
from fulmar_core.robots.robot import Robot


def look_of(robot: Robot) -> tuple[Part, ...]:
    """The parts of a robot's look; of one without `look` its hull and its nozzles."""
    return robot.look or (*hull_of(robot), *_nozzles(robot))


def look_as_json(robot: Robot) -> list[dict[str, Any]]:
    """The same as `robot_info` has it: lengths in metres, quaternions x, y, z, w, colours from 0 to 1.

    Meshes carry triangles of their own, few of them; `size` of such a part is its bounding box.
    """
    parts = look_of(robot)
    share = share_of(parts)
    return [
        {
            "shape": part.shape,
            "size": list(boxed(part).size),
            "at": list(part.at),
            "quat": [round(each, 6) for each in part.quat_xyzw],
            "color": part.color if part.color == "own" else list(part.rgba),
            **({"mesh": packed(outline_of(part, share))} if part.shape == "mesh" else {}),
            **({"moves": part.moves, "about": list(part.about), "gain": part.gain} if part.moves else {}),
        }
        for part in parts
    ]


def hull_of(robot: Robot) -> tuple[Part, ...]:
    """The outline of the body as a part: a box, in space a ball, else a cylinder."""
    body, (low, high) = robot.body, robot.hull_span
    middle = (body.footprint_x, 0.0, 0.5 * (low + high))
    if body.footprint is not None:
        return (Part("box", (*body.footprint, high - low), middle),)
    if robot.state_type.AXES == 3:
        return (Part("sphere", (2.0 * body.radius,), middle),)
    return (Part("cylinder", (2.0 * body.radius, high - low), middle),)


NOZZLE_M = 0.04  # length of what shows an actuator, our value [m]


def _nozzles(robot: Robot) -> tuple[Part, ...]:
    """A cone that opens where the gas leaves, a wheel, or a ball of a caster."""
    parts = []
    for each in robot.actuators.fixtures:
        if len(each.wheel) == 1:
            parts.append(Part("sphere", (2.0 * each.wheel[0],), each.position, color="dark"))
        elif each.wheel:
            size = (2.0 * each.wheel[0], each.wheel[1])
            parts.append(Part("cylinder", size, each.position, (90.0, 0.0, 0.0), "dark"))
        elif each.axis is not None:
            x, y, z = each.axis
            rpy = (0.0, math.degrees(math.atan2(math.hypot(x, y), z)), math.degrees(math.atan2(y, x)))
            parts.append(Part("cone", (NOZZLE_M, NOZZLE_M), each.position, rpy, "orange"))
    return tuple(parts)
