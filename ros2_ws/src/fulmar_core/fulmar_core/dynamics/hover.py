"""What carries a robot that nothing but its actuators holds up."""

from __future__ import annotations

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.robot import Robot
from fulmar_core.states.gravity import GRAVITY
from fulmar_core.states.spatial import SpatialState


def level_state() -> SpatialState:
    """At rest at the origin, level, shapes ()."""
    zero, one = np.asarray(0.0), np.asarray(1.0)
    return SpatialState.at_rest((zero, zero, zero), (zero, zero, zero, one))


def hover_command(robot: Robot) -> np.ndarray:
    """Command that carries a robot, level and at rest in still surroundings, shape (n,).

    Raises:
        ConfigError: No command does, with something left of each actuator.
    """
    wrenches, least, _ = robot.actuators.full_wrenches or (np.zeros((1, 6)), np.zeros(1), False)
    weight = np.array([0.0, 0.0, robot.body.mass * GRAVITY, 0.0, 0.0, 0.0])
    weight[3:] = np.cross(robot.body.com, weight[:3])
    found = np.linalg.lstsq(wrenches.T, weight, rcond=None)[0]
    held = np.abs(wrenches.T @ found - weight).max() < 1e-6 * weight[2]
    if not held or np.any((found <= least) | (found >= 1.0)):
        raise ConfigError(
            f"the {robot.actuators.kind} of '{robot.name}' do not carry its {weight[2]:.3g} N, level and with "
            "something left to steer. Correct their thrust, their places, or the mass."
        )
    return np.asarray(found * robot.actuators.scale)
