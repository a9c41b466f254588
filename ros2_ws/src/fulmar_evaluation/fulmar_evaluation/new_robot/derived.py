"""Numbers of a robot's file that follow from its body and its actuators, scaled from those of the robot it is like."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import numpy as np

from fulmar_core.robots.robot import Robot
from fulmar_evaluation.new_robot.by_kind import ROOM, RULES
from fulmar_evaluation.performance_gaps import most_in_plane
from fulmar_evaluation.wrench_limits import wrench_set_of

DIGITS = 6  # of a computed number
ROUNDED = 1.0 - 1e-5  # of a number that is rounded and has to stay below another one [-]


@dataclass(frozen=True)
class Ratios:
    """A new body over that of the robot that it is like [-]."""

    mass: float
    inertia: float  # about z
    size: float  # of the circles around both

    @classmethod
    def of(cls, body: dict[str, Any], like: Robot) -> Ratios:
        """Of the `body` of a robot's file."""
        return cls(
            body["mass"] / like.body.mass,
            body["inertia"][2] / like.body.inertia[2],
            body["radius"] / like.body.radius,
        )


def scale_parts(robot: dict[str, Any], like: Robot, given: Collection[str]) -> list[str]:
    """Scale what goes with mass, inertia and size, in place: spans, water, motors.

    Args:
        robot: Keys of the new file, with its own `body`.
        like: The robot that it is like, whose other numbers stand in the new file.
        given: Dotted keys that stay: a user or a file gave them.

    Returns:
        Dotted keys that were scaled.
    """
    by, body = Ratios.of(robot["body"], like), robot["body"]
    spans = like.uncertainty
    # In the plane no moment is beyond the sum of the two others; rounding stays below it.
    highest = np.inf if like.state_type.AXES == 3 else ROUNDED * (body["inertia"][0] + body["inertia"][1])
    new: dict[str, Any] = {
        "uncertainty.mass": [by.mass * each for each in spans.mass],
        "uncertainty.yaw_inertia": [min(by.inertia * each, highest) for each in spans.yaw_inertia],
        "uncertainty.center_of_mass": by.size * spans.center_of_mass,
    }
    new |= RULES[like.kind.name].motors(body, like)
    if like.hydrodynamics is not None:
        new |= _water(like, by, body["mass"])
    return _put(robot, new, given)


def _water(like: Robot, by: Ratios, mass: float) -> dict[str, Any]:
    """Damping by mass and inertia, areas and lengths by size, and the draught at which it floats."""
    water = like.hydrodynamics
    assert water is not None
    forces = (by.mass,) * 3 + (by.inertia,) * 3
    new: dict[str, Any] = {
        f"hydrodynamics.{key}": [
            factor * each for factor, each in zip(forces, getattr(water, key), strict=True)
        ]
        for key in ("linear_damping", "quadratic_damping", "added_mass")
    }
    still = water.hydrostatics
    area = by.size**2 * still.waterplane_area
    key = "hydrodynamics.hydrostatics"
    return new | {
        f"{key}.waterplane_area": area,
        f"{key}.draught": mass / (still.water_density * area),
        f"{key}.metacentric_height_roll": by.size * still.metacentric_height_roll,
        f"{key}.metacentric_height_pitch": by.size * still.metacentric_height_pitch,
    }


def scale_performance(robot: dict[str, Any], trial: Robot, like: Robot, given: Collection[str]) -> list[str]:
    """Compute what the robot can do from its actuators, and scale speeds and limits with it, in place.

    Args:
        robot: Keys of the new file.
        trial: The same, read; its `performance` and `limits` are those of the other.
        like: The robot that it is like.
        given: Dotted keys that stay.

    Returns:
        Dotted keys that were computed.
    """
    rules = RULES[like.kind.name]
    if not rules.computed:
        return []
    can, limits = like.performance, like.limits
    wrenches = wrench_set_of(trial)
    force, torque = most_in_plane(wrenches)
    force, torque = (force if can.force else 0.0), torque or can.torque
    pull = force * like.body.mass / (can.force * trial.body.mass) if can.force else 0.0
    turn = torque * like.body.inertia[2] / (can.torque * trial.body.inertia[2])
    top = rules.top_speed(trial, like, force, pull)
    pace = top / can.top_speed if can.top_speed else 0.0
    yaw_rate, yaw_limit = rules.yaw_rates(trial, like, turn)
    new = {
        "performance.force": force,
        "performance.torque": torque,
        "performance.top_speed": top,
        **{
            f"performance.{key}": pace * getattr(can, key)
            for key in ("speed", "reverse_speed", "lateral_speed")
        },
        "performance.yaw_rate": yaw_rate,
        "performance.turning_acceleration": pull * can.turning_acceleration,
        "limits.speed": max(pace * limits.speed, ROOM * top) if top else limits.speed,
        "limits.yaw_rate": yaw_limit,
    }
    return _put(robot, new, given)


def _put(robot: dict[str, Any], new: dict[str, Any], given: Collection[str]) -> list[str]:
    """Write values at dotted keys that exist in the file, or are wanted in it, unless they are given."""
    changed = []
    for key, value in new.items():
        if key in given or any(key.startswith(f"{each}.") for each in given):
            continue
        *above, last = key.split(".")
        part = robot
        for name in above:
            part = part[name]
        found = [_short(each) for each in value] if isinstance(value, list) else _short(value)
        if last in part and part[last] != found:
            part[last] = found
            changed.append(key)
    return changed


def _short(value: float) -> float:
    return float(f"{float(value):.{DIGITS}g}")
