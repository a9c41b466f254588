"""A robot's file from a geometry and its coefficients: what neither says is that of an aircraft that it is like."""

from __future__ import annotations

import math
import re
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_core.config.atomic_write import write_whole
from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_path
from fulmar_core.config.yaml_text import dump, load
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot, load_robot_file
from fulmar_evaluation.new_airframe.coefficient_set import Terms
from fulmar_evaluation.new_airframe.geometry import Geometry

DIGITS = 6  # of numbers that the lattice computes


def write_robot(
    shape: Geometry, terms: Terms, out: Path, source: str, *, geometry: Path | str = "the geometry"
) -> Path:
    """Load the file as `fulmar check robot` does, and write it.

    Args:
        shape: Of the aircraft.
        terms: Of `coefficient_set`.
        out: The file.
        source: Where the coefficients come from, for its head.
        geometry: The file of the shape, for messages.

    Raises:
        ConfigError: The aircraft that it is like is none, or the file is one that no robot can be.
    """
    like = load_robot(shape.like)
    if not like.flies:
        raise ConfigError(f"'like: {shape.like}' is no aircraft. `fulmar list robots` shows others.")
    robot: dict[str, Any] = load(config_path("robots", shape.like).read_text(encoding="utf-8"))
    wing, inertia = shape.wing, list(shape.inertia)
    robot |= {"name": shape.name, "title": shape.title}
    robot["body"].pop("as_printed", None)  # of the other's inertia
    robot["body"] |= {"mass": shape.mass, "inertia": inertia, **outline(shape)}
    robot["uncertainty"] = {
        "mass": [round(share * shape.mass, DIGITS) for share in (0.95, 1.05)],
        "yaw_inertia": [round(share * inertia[2], DIGITS) for share in (0.9, 1.1)],
    }
    robot["airframe"] = {
        "span": wing.span,
        "area": round(wing.area, DIGITS),
        "chord": round(wing.mean_chord, DIGITS),
        "taper": wing.taper,
        "speed": shape.speed,
        "stall_deg": shape.stall_deg,
        "ground_effect": {"wing_height": wing.position[1], "efficiency": _efficiency(shape, terms)},
        "aerodynamics": {
            "unit": "rad",
            "terms": {
                name: {key: round(value, DIGITS) for key, value in each.items()}
                for name, each in terms.items()
            },
        },
    }
    _scale(robot, like, shape)
    robot["performance"] |= {"speed": shape.speed, "top_speed": round(1.4 * shape.speed, DIGITS)}
    head = (
        f"# {source}\n# What a geometry does not say, such as servos and sensors, is of {shape.like}; motors,\n"
        "# performance and limits are its own, scaled by weight, span and speed.\n"
    )
    content = (head + dump(robot)).encode()
    with tempfile.TemporaryDirectory(
        prefix="fulmar-"
    ) as folder:  # what no robot can be leaves no file behind
        trial = Path(folder) / out.name
        trial.write_bytes(content)
        try:
            load_robot_file(trial)
        except ConfigError as error:
            said = re.sub(rf"^{re.escape(str(trial))}(:\d+)?: ", "", str(error))
            raise ConfigError(
                f"{geometry}: makes no aircraft, and {out} is not written: {said} Its radius of "
                f"{robot['body']['radius']:g} m follows from the surfaces."
            ) from error
    write_whole({out: content})
    return out


def outline(shape: Geometry) -> dict[str, Any]:
    """Radius, height and footprint of the body that encloses all surfaces, as in a robot's `body` [m]."""
    corners = np.concatenate([mesh.reshape(-1, 3) for mesh in shape.meshes().values()])  # aft, right, up
    low, high = corners.min(axis=0), corners.max(axis=0)
    return {
        "radius": round(float(np.hypot(corners[:, 0], corners[:, 1]).max()) + 1e-3, 3),
        "height": round(float(high[2] - low[2]), 3),
        "footprint": [round(float(high[0] - low[0]), 3), round(float(high[1] - low[1]), 3)],
        "footprint_x": round(-0.5 * float(high[0] + low[0]), 3),
    }


def _scale(robot: dict[str, Any], like: Robot, shape: Geometry) -> None:
    """Give motors, performance and limits of the craft that it is like the size of this one.

    Thrust goes with the weight, sizes with the span, speeds with that of cruise, and the tips of propellers are as
    fast as theirs.
    """
    weight, span = shape.mass / like.body.mass, shape.wing.span / like.wings.span
    speed = shape.speed / like.wings.speed
    by = {
        "thrust": weight,
        "disc_area": span**2,
        "jet_speed": speed,
        "top_rate": 1.0 / span,
        "torque_per_speed2": weight * span**3,
        "power": weight * speed,
    }
    for motor in robot["actuators"]["motors"]:
        motor["position"] = [_round(span * each) for each in motor.get("position", [0.0] * 3)]
        for key, factor in by.items():
            if key in motor["engine"]:
                motor["engine"][key] = _round(factor * float(motor["engine"][key]))
    performance, limits = robot["performance"], robot["limits"]
    performance["force"] = _round(weight * performance["force"])
    turning = shape.inertia[2] / like.body.inertia[2] * (speed / span) ** 2
    performance["torque"] = _round(turning * performance["torque"])
    performance["yaw_rate"] = _round(performance["yaw_rate"] / speed)
    limits["speed"] = _round(speed * limits["speed"])


def _round(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def _efficiency(geometry: Geometry, terms: Terms) -> float:
    """Oswald's number of the lattice's own parabola, at most 1."""
    aspect = geometry.wing.span**2 / geometry.wing.area
    slope, bend = terms["CL"]["alpha"], terms["CD"]["alpha^2"]
    return round(min(1.0, slope**2 / (math.pi * aspect * max(bend, 1e-9))), 3)
