"""Pauses, steps and states of a simulation that runs: requests as JSON objects, checked for the plant."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from fulmar_core.config.errors import ConfigError, UnknownNameError
from fulmar_core.robots.robot import Robot
from fulmar_core.states.state import RigidBodyState

PLACE, RESET, PAUSE, RESUME, STEP = REQUESTS = ("place", "reset", "pause", "resume", "step")
MOST_STEPS = 10_000  # of one request
FARTHEST_M = 100_000.0  # from the origin of the world; a place farther away is a mistake of units [m]
LEVEL = 1e-6  # of what a robot in the plane does not have: more is a mistake, less is rounding
NORM = 0.01  # that a quaternion may differ from 1 by
# Fields of a place with how many numbers each has, and whether it may be left out: it is at rest then.
FIELDS = {
    "position_m": (3, False),
    "quat_xyzw": (4, False),
    "velocity_m_s": (3, True),
    "rate_rad_s": (3, True),
}


def read_state(request: Mapping[str, Any], robot: Robot) -> RigidBodyState:
    """The state that a request puts a robot into.

    Args:
        request: `position_m` and `quat_xyzw` in the world of the simulation, `velocity_m_s` along its axes and
            `rate_rad_s` about the body's own, which are 0 where they are left out; keys that say who asks are left out.
        robot: The simulated robot.

    Raises:
        ConfigError: A field is missing or misspelt, a number is out of its range, or no such robot can be so.
    """
    given = {key: value for key, value in request.items() if key not in ("what", "id", "by")}
    for key in given:
        if key not in FIELDS:
            raise UnknownNameError("field of 'place'", key, tuple(FIELDS))
    position, quat, velocity, rate = (_numbers(given, key) for key in FIELDS)
    norm = float(np.linalg.norm(quat))
    if abs(norm - 1.0) > NORM:
        raise ConfigError(f"'quat_xyzw' has norm {norm:.3f}, must be 1.")
    if float(np.abs(position).max()) > FARTHEST_M:
        raise ConfigError(f"'position_m' is {position.tolist()}, must be within {FARTHEST_M:,.0f} m.")
    limits = robot.limits
    for words, value, most, unit in (
        ("velocity_m_s", velocity, limits.speed, "m/s"),
        ("rate_rad_s", rate, limits.yaw_rate, "rad/s"),
    ):
        size = float(np.linalg.norm(value))
        if size > most:
            raise ConfigError(f"'{words}' is {size:.3g} {unit}, of '{robot.name}' at most {most:g} {unit}.")
    if robot.state_type.AXES == 2:
        beside = (position[2], quat[0], quat[1], velocity[2], rate[0], rate[1])
        if max(abs(float(part)) for part in beside) > LEVEL:
            raise ConfigError(
                f"'{robot.name}' moves in {robot.state_type.WORLD}: it has no height, no roll and no pitch."
            )
    return RigidBodyState(position, quat / norm, velocity, rate)


def read_steps(request: Mapping[str, Any]) -> int:
    """How many control steps a request asks for: `steps`, 1 where it is left out.

    Raises:
        ConfigError: It is no such number.
    """
    steps = request.get("steps", 1)
    if not isinstance(steps, int) or isinstance(steps, bool) or not 1 <= steps <= MOST_STEPS:
        raise ConfigError(f"'steps' is {steps!r}, must be a whole number from 1 to {MOST_STEPS}.")
    return steps


def state_fields(state: RigidBodyState) -> dict[str, list[float]]:
    """The fields of a request that puts a robot into a state."""
    values = (
        state.position_in_world,
        state.quat_xyzw,
        state.velocity_in_world,
        state.angular_velocity_in_body,
    )
    return {key: np.asarray(value, dtype=float).tolist() for key, value in zip(FIELDS, values, strict=True)}


def _numbers(given: Mapping[str, Any], key: str) -> np.ndarray:
    """One field, shape (3,) or (4,)."""
    count, optional = FIELDS[key]
    value = given.get(key)
    if value is None and optional:
        return np.zeros(count)
    good = isinstance(value, list | tuple) and len(value) == count and all(map(_is_finite, value))
    if not good:
        raise ConfigError(f"'{key}' is {value!r}, must be {count} finite numbers.")
    assert value is not None
    return np.array(value, dtype=float)


def _is_finite(number: Any) -> bool:
    return isinstance(number, int | float) and not isinstance(number, bool) and math.isfinite(number)
