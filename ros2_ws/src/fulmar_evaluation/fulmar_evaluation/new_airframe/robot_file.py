"""A robot's file from a geometry and its coefficients: what neither says is that of an aircraft that it is like."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import Any

import yaml

from fulmar_core.config.atomic_write import write_whole
from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_path
from fulmar_core.robots.robot_file import load_robot, load_robot_file
from fulmar_evaluation.new_airframe.coefficient_set import Terms
from fulmar_evaluation.new_airframe.geometry import Geometry

DIGITS = 6  # of numbers that the lattice computes


def write_robot(geometry: Geometry, terms: Terms, out: Path, source: str) -> Path:
    """Load the file as `fulmar check robot` does, and write it.

    Args:
        geometry: Of the aircraft.
        terms: Of `coefficient_set`.
        out: The file.
        source: Where the coefficients come from, for its head.

    Raises:
        ConfigError: The aircraft that it is like is none, or the file is one that no robot can be.
    """
    if not load_robot(geometry.like).flies:
        raise ConfigError(f"'like: {geometry.like}' is no aircraft. `fulmar list robots` shows others.")
    robot: dict[str, Any] = yaml.safe_load(config_path("robots", geometry.like).read_text(encoding="utf-8"))
    wing, inertia = geometry.wing, list(geometry.inertia)
    robot |= {"name": geometry.name, "title": geometry.title}
    robot["body"] |= {"mass": geometry.mass, "inertia": inertia}
    robot["uncertainty"] = {
        "mass": [round(share * geometry.mass, DIGITS) for share in (0.95, 1.05)],
        "yaw_inertia": [round(share * inertia[2], DIGITS) for share in (0.9, 1.1)],
    }
    robot["airframe"] = {
        "span": wing.span,
        "area": round(wing.area, DIGITS),
        "chord": round(wing.mean_chord, DIGITS),
        "taper": wing.taper,
        "speed": geometry.speed,
        "stall_deg": geometry.stall_deg,
        "ground_effect": {"wing_height": wing.position[1], "efficiency": _efficiency(geometry, terms)},
        "aerodynamics": {
            "unit": "rad",
            "terms": {
                name: {key: round(value, DIGITS) for key, value in each.items()}
                for name, each in terms.items()
            },
        },
    }
    robot["performance"] |= {"speed": geometry.speed, "top_speed": round(1.4 * geometry.speed, DIGITS)}
    head = f"# {source}\n# What a geometry does not say, such as servos, motors and sensors, is of {geometry.like}.\n"
    content = (head + yaml.safe_dump(robot, sort_keys=False, allow_unicode=True)).encode()
    with tempfile.TemporaryDirectory(
        prefix="fulmar-"
    ) as folder:  # what no robot can be leaves no file behind
        trial = Path(folder) / out.name
        trial.write_bytes(content)
        try:
            load_robot_file(trial)
        except ConfigError as error:
            raise ConfigError(str(error).replace(str(trial), str(out))) from error
    write_whole({out: content})
    return out


def _efficiency(geometry: Geometry, terms: Terms) -> float:
    """Oswald's number of the lattice's own parabola, at most 1."""
    aspect = geometry.wing.span**2 / geometry.wing.area
    slope, bend = terms["CL"]["alpha"], terms["CD"]["alpha^2"]
    return round(min(1.0, slope**2 / (math.pi * aspect * max(bend, 1e-9))), 3)
